"""The coupled problem of one lever, and how the peer solves it."""

import dataclasses

import dolfin as df
import forms
import numpy as np
from supplies import Supplies

# What an iteration still has to go is estimated from its last step: the step squared over
# NEWTON_RADIUS_K after a step with a new factorisation, a geometric series after others.
NEWTON_RADIUS_K = 20.0
KELVIN_PER_VOLT = 100.0  # weighs potential against temperature steps in the tests above
STEP_LIMIT_K = 150.0  # the largest temperature change of one Newton or predictor step
MAX_ITERATIONS = 30
MAX_HALVINGS = 6  # of the step to a bias that was not reached at once


@dataclasses.dataclass(frozen=True)
class Strategy:
    """How the nonlinear equations are solved; the results are the same."""

    renew_rate: float  # factorise anew when a step is longer than this times the one before
    predictor_points: int  # bias points that the polynomial predictor goes through
    lu_method: str
    lu_ordering: str | None


# PETSc's own LU with this ordering was the fastest of those that Debian's dolfin has.
TUNED = Strategy(renew_rate=0.3, predictor_points=3, lu_method="petsc", lu_ordering="amd")
# What dolfin's NewtonSolver does: a new Jacobian every step, its default LU, the last solution as
# the start.
PLAIN = Strategy(renew_rate=0.0, predictor_points=1, lu_method="default", lu_ordering=None)


class Lever:
    """The coupled problem of one lever, and the state from which the next bias point starts."""

    def __init__(self, problem, strategy):
        """Build mesh, space, forms and linear solver from the problem dictionary."""
        self.strategy, self.tolerance_K = strategy, problem["tolerance_K"]
        self.supplies = Supplies(problem)
        mesh = forms.dolfin_mesh(problem["points_um"], problem["triangles"])
        element = df.VectorElement("P", mesh.ufl_cell(), problem["degree"], dim=2)
        space = df.FunctionSpace(mesh, element)
        self.state = df.Function(space)
        self.parameters = {
            name: df.Constant(value) for name, value in problem["parameters"].items()
        }
        cells = forms.cell_markers(mesh, problem["stack"])
        self.past = []  # in time: states, the present one first, and their weights [1/us]
        if "times_us" in problem:
            states = [self.state, df.Function(space), df.Function(space)]
            self.past = [(one, df.Constant(0.0)) for one in states]
            for one in states:  # never 0 K, even where its weight is zero
                one.vector()[:] = problem["circuit"]["base_temperature_K"]
        residual, jacobian = forms.coupled_forms(
            space, self.state, cells, problem, self.parameters, self.past
        )
        self.residual_form, self.jacobian_form = df.Form(residual), df.Form(jacobian)
        where = forms.Places(space, problem, self.supplies)
        self.temperature_dofs, self.end_dofs = where.temperature_dofs, where.end_dofs
        self.ground_dofs, self.fixed_dofs = where.ground_dofs, where.fixed_dofs
        self.contact_dofs, self.sense_weights = where.contact_dofs, where.sense_weights
        self.cold = where.cold
        self.tip_weights = forms.point_weights(space, problem["tip_um"])
        self.kelvin_per_unit = np.full(space.dim(), KELVIN_PER_VOLT)
        self.kelvin_per_unit[self.temperature_dofs] = 1.0

        self.matrix, self.rhs = df.PETScMatrix(), df.PETScVector()
        self.solution, self.current_row = (self.state.vector().copy() for _ in range(2))
        self.unit_rises = []  # 1 V on one contact, 0 elsewhere
        for dofs in self.contact_dofs:
            indicator = np.zeros(space.dim())
            indicator[dofs] = 1.0
            self.unit_rises.append(self.state.vector().copy())
            self.unit_rises[-1][:] = indicator
        self.solver = None  # made with the first matrix
        self.iterations = 0
        self.factorisations = 0
        self.start({})

    def start(self, parameters):
        """Go back to zero bias, with some of the parameters changed."""
        for name, value in parameters.items():
            self.parameters[name].assign(value)
        self.values, self.is_stale = self.cold, True
        self.history = {0.0: self.values}  # bias [V] -> solution, the latest last
        ends = self.cold[self.end_dofs]
        if np.any(self.supplies.held) or np.ptp(ends) > 0.0:
            # the others first, from nothing to all that they hold
            self.reach(1.0, lambda share: self.supplies.values(0.0, share))
            self.history = {0.0: self.values}

    def residual(self):
        """Return the residual [mW, mA] of the present values, fixed rows included.

        A fixed row holds what flows into the lever there: heat [mW] or current [mA].
        """
        self.state.vector()[:] = self.values
        df.assemble(self.residual_form, tensor=self.rhs)
        return self.rhs.get_local()

    def factorise(self):
        """Renew the Newton matrix, and the responses to the potentials of the contacts."""
        df.assemble(self.jacobian_form, tensor=self.matrix)
        slopes, responses = [], []
        for rise in self.unit_rises:
            self.matrix.transpmult(rise, self.current_row)
            slopes.append(self.current_row.get_local())
        self.current_slopes = np.array(slopes)  # dI / du, one row each
        self.matrix.ident(self.fixed_dofs)
        if self.solver is None:
            self.solver = df.PETScLUSolver(self.matrix, self.strategy.lu_method)
            if self.strategy.lu_ordering:
                self.solver.ksp().getPC().setFactorOrdering(self.strategy.lu_ordering)
        for rise in self.unit_rises:
            self.solver.solve(self.solution, rise)
            responses.append(self.solution.get_local())
        self.responses = np.array(responses)  # du / dV, one row each
        self.is_stale = False
        self.factorisations += 1

    def potentials(self):
        """Return the potentials [V] of the contacts."""
        return np.array([self.values[dofs[0]] for dofs in self.contact_dofs])

    def currents(self, residual):
        """Return what flows into the lever at the contacts [mA]: the consistent flux."""
        return np.array([residual[dofs].sum() for dofs in self.contact_dofs])

    def newton_step(self, given, residual):
        """Return the step that solves the linearised field and circuit equations together."""
        free = -residual
        free[self.fixed_dofs] = 0.0
        self.rhs[:] = free
        self.solver.solve(self.solution, self.rhs)
        step = self.solution.get_local()  # at fixed potentials of the contacts
        currents = self.currents(residual) + self.current_slopes @ step
        a, b = self.supplies.by_potential, self.supplies.by_current
        lacking = given - a * self.potentials() - b * currents
        matrix = np.diag(a) + b[:, None] * (self.current_slopes @ self.responses.T)
        return step + np.linalg.solve(matrix, lacking) @ self.responses

    def limited(self, step):
        """Return the step, shortened where it exceeds the temperature limit."""
        longest = np.abs(step[self.temperature_dofs]).max()
        return step * min(1.0, STEP_LIMIT_K / max(longest, STEP_LIMIT_K))

    def iterate(self, given):
        """Iterate from the present values with these supplies; return whether it converged."""
        previous_length = 0.0
        for iteration in range(1, MAX_ITERATIONS + 1):
            residual = self.residual()
            is_new = self.is_stale
            if is_new:
                self.factorise()
            step = self.newton_step(given, residual)
            self.values = self.values + self.limited(step)
            self.iterations += 1
            length = (np.abs(step) * self.kelvin_per_unit).max()
            if not np.isfinite(length):
                break
            if is_new:
                rate = length / NEWTON_RADIUS_K
            elif iteration > 1:
                rate = length / previous_length
            else:
                rate = self.strategy.renew_rate
            self.is_stale = rate > self.strategy.renew_rate
            if length * rate < self.tolerance_K * (1.0 - rate):
                return True
            previous_length = length
        self.is_stale = True
        return False

    def reach(self, target, supplies):
        """Bring the values to the solution at a target, by way of others if need be.

        `supplies` gives the values of the supplies at a target: a bias, or a share.
        """
        ahead = [target]  # the next target last
        while ahead:
            last, last_values = list(self.history.items())[-1]
            predicted = predicted_step(self.history, ahead[-1], self.strategy.predictor_points)
            self.values = last_values + self.limited(predicted)
            if self.iterate(supplies(ahead[-1])):
                reached = ahead.pop()
                self.history.pop(reached, None)
                self.history[reached] = self.values
            elif len(ahead) <= MAX_HALVINGS:
                ahead.append((last + ahead[-1]) / 2.0)
            else:
                raise RuntimeError(
                    f"no convergence between a bias of {last} and {ahead[-1]} V: with this "
                    "series resistance the state may not be a single-valued function of the bias"
                )

    def sweep(self, bias_values):
        """Solve for each bias [V] in turn and return the lists of results."""
        rows = []
        for bias in bias_values:
            iterations_before, factorisations_before = self.iterations, self.factorisations
            self.reach(bias, self.supplies.values)
            residual = self.residual()
            potentials, currents = self.potentials(), self.currents(residual)
            held = self.supplies.names[1:]
            rows.append(
                {
                    "bias_V": bias,
                    "current_mA": currents[0],
                    "lever_V": potentials[0],
                    **{f"{name}_V": w @ self.values for name, w in self.sense_weights.items()},
                    **{f"{name}_V": V for name, V in zip(held, potentials[1:], strict=True)},
                    **{f"{name}_mA": mA for name, mA in zip(held, currents[1:], strict=True)},
                    "tip_K": self.tip_weights @ self.values,
                    "power_mW": potentials[0] * currents[0],
                    "newton_iterations": self.iterations - iterations_before,
                    "factorisations": self.factorisations - factorisations_before,
                    "ground_current_mA": -residual[self.ground_dofs].sum(),
                    "heat_out_mW": -residual[self.end_dofs].sum(),
                }
            )
        return {name: [row[name] for row in rows] for name in rows[0]}


def predicted_step(history, target, points):
    """Return the step to the polynomial in the target through the latest points."""
    nodes = list(history)[-points:]
    step = -history[nodes[-1]]
    for node in nodes:
        others = [other for other in nodes if other != node]
        step = step + np.prod([(target - o) / (node - o) for o in others]) * history[node]
    return step
