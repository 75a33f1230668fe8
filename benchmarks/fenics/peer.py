"""Independent legacy-FEniCS solver of the paper's two-dimensional vacuum model.

    /usr/bin/python3 peer.py PROBLEM.json -o RESULT.json [--plain]
    /usr/bin/python3 peer.py PROBLEM.json --serve [--plain]

With --serve it keeps mesh and forms, and answers each line on standard input, a JSON dictionary of
material values, with a line of results, until the input ends.

Solves, on a Joule-heated silicon lever of uniform thickness,

    -div(kappa(T) grad T) = sigma(x, T) |grad V|^2,      div(sigma(x, T) grad V) = 0,

with T at the base temperature on every terminal, V = 0 at the ground terminal, no current through
the reader terminal, and the supply terminal an equipotential contact at the unknown lever voltage
V_l, fixed by the series resistor: (V_b - V_l) / R_s = I_h.

The state u = (T, V) lives in one two-component Lagrange space.  The Newton matrix is the exact UFL
derivative of the residual.  It is factorised anew only when the steps it gives stop shrinking fast
(the residual is always the exact one, so this costs no accuracy); with --plain, at every step.
V_l is one extra unknown, eliminated exactly by bordering: one factorisation serves two right-hand
sides, the residual and a unit rise of V_l.  I_h is the consistent flux, the residual of the charge
equation summed over the supply terminal, so that charge and energy balance to rounding error.

With "times_us" in the problem the bias, the first of "bias_V", is switched on at time zero, and the
enthalpy is stepped by the two-step backward differentiation formula, with steps that grow by a
given factor; the results are those at the times.

Units throughout: um, K, V, mA, mW, kohm (which makes every equation free of conversion factors);
doping and carrier densities in cm^-3 and mobilities in cm^2/(V s), as printed in the paper.

Equations are named by their labels in the paper's source (the doping profile is "dp").  The sign of
Eq. 1 is corrected; the ratio of the hole and electron impurity mobilities is the printed 0.746,
which is not (0.33 / 0.55)^(1/2) = 0.775.
"""

import argparse
import dataclasses
import json
import sys
import time
from itertools import pairwise

import dolfin as df
import numpy as np
import ufl

BOLTZMANN_EV_PER_K = 8.617333262e-5
ELEMENTARY_CHARGE_C = 1.6e-19
IMPURITY_MOBILITY_RATIO = 0.746  # hole / electron, as printed below Eq. 9
PHONON_MOBILITY_RATIO = 0.279  # hole / electron, Eq. 10
REFERENCE_TEMPERATURE_K = 300.0

MA_PER_V_UM_FROM_S_PER_CM = 0.1  # 1 S/cm = 0.1 mA/(V um)
MW_PER_UM_K_FROM_W_PER_CM_K = 0.1  # 1 W/(cm K) = 0.1 mW/(um K)

HIGH_DOPED = 0  # cell tag of all highly doped silicon; tapered regions are tagged 1, 2, ...
SUPPLY, GROUND, READER, OTHER_END = 1, 2, 3, 4  # edge tags
TERMINAL_TAGS = {"supply": SUPPLY, "ground": GROUND, "reader": READER}
MATERIAL_NAMES = ("c_kappa", "delta", "n_d", "p", "a0", "a1", "n_hd")

# What an iteration still has to go is estimated from its last step: the step squared over
# NEWTON_RADIUS_K after a step with a new factorisation, a geometric series after others.
TOLERANCE_K = 1e-6
NEWTON_RADIUS_K = 20.0
KELVIN_PER_VOLT = 100.0  # weighs potential against temperature steps in the tests above
STEP_LIMIT_K = 150.0  # the largest temperature change of one Newton or predictor step
MAX_ITERATIONS = 30
FIRST_STEP = 1e-3  # in time, as a share of the first one that is asked for
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


def thermal_conductivity(temperature, material):
    """Return kappa [mW/(um K)], Eq. 4.

    The argument of tanh is clipped at +-40, where tanh is +-1 to machine precision, because UFL
    differentiates tanh to a ratio of cosh that overflows for large arguments.
    """
    above_step = temperature - 680.0
    clipped = ufl.max_value(ufl.min_value(above_step, 40.0), -40.0)
    resistivity_cm_k_per_w = (
        0.707
        + 3.15e-3 * (temperature - REFERENCE_TEMPERATURE_K)
        + 5.25e-4 * (1.0 + ufl.tanh(clipped)) * above_step
    )
    return MW_PER_UM_K_FROM_W_PER_CM_K * material["c_kappa"] / resistivity_cm_k_per_w


def enthalpy(temperature):
    """Return the heat [nJ/um^3] of silicon, by Shomate's equation (NIST Chemistry WebBook)."""
    t = temperature / 1000.0
    kilojoule_per_mol = (
        22.81719 * t
        + 3.899510 * t**2 / 2.0
        - 0.082885 * t**3 / 3.0
        + 0.042111 * t**4 / 4.0
        + 0.354063 / t
    )
    return kilojoule_per_mol * 2.329 / 28.0855  # 1 kJ/cm^3 = 1 nJ/um^3


def high_doped_conductivity(temperature, material):
    """Return sigma_hd [mA/(V um)], Eq. 11."""
    resistivity_ohm_cm = material["a0"] + material["a1"] * (temperature - REFERENCE_TEMPERATURE_K)
    return MA_PER_V_UM_FROM_S_PER_CM / resistivity_ohm_cm


def tapered_doping(distance, length, material):
    """Return n_ld [cm^-3], Eq. dp, at a distance [um] from the centre of a region [um] long."""
    edges = (
        ufl.erf((distance - length / 2.0) / material["delta"])
        + ufl.erf((-distance - length / 2.0) / material["delta"])
    ) / 2.0
    return material["n_d"] + (material["n_hd"] - material["n_d"]) * (1.0 + edges)


def bordered_doping(position, borders, material):
    """Return the same for a region of any outline, from its distances to lines of points [um]."""
    share = 0.0
    for border in borders:
        squares = []
        for start, end in pairwise(border):
            a, along = df.Constant(start), df.Constant([end[0] - start[0], end[1] - start[1]])
            where = df.dot(position - a, along) / df.dot(along, along)
            away = position - a - ufl.max_value(0.0, ufl.min_value(1.0, where)) * along
            squares.append(df.dot(away, away))
        nearest = squares[0]
        for square in squares[1:]:
            nearest = ufl.min_value(nearest, square)
        share += (1.0 - ufl.erf(ufl.sqrt(nearest) / material["delta"])) / 2.0
    return material["n_d"] + (material["n_hd"] - material["n_d"]) * ufl.min_value(share, 1.0)


def low_doped_conductivity(temperature, doping, material):
    """Return sigma_ld [mA/(V um)], Eqs. 5-10, for a doping [cm^-3]."""
    relative = temperature / REFERENCE_TEMPERATURE_K
    band_gap_ev = (
        1.17
        - 4.73e-4 * temperature**2 / (temperature + 636.0)
        - 0.025 * (doping / 1e18) ** (1.0 / 3.0)
    )
    intrinsic = (
        2.70e19 * relative**1.5 * ufl.exp(-band_gap_ev / (2.0 * BOLTZMANN_EV_PER_K * temperature))
    )
    electrons = (doping + ufl.sqrt(doping**2 + 4.0 * intrinsic**2)) / 2.0
    holes = intrinsic**2 / electrons

    electron_impurity = 4.1e11 / ufl.sqrt(doping)
    electron_phonon = 1.6e3 * relative ** (-material["p"])
    electron_mobility = 1.0 / (1.0 / electron_impurity + 1.0 / electron_phonon)
    hole_mobility = 1.0 / (
        1.0 / (IMPURITY_MOBILITY_RATIO * electron_impurity)
        + 1.0 / (PHONON_MOBILITY_RATIO * electron_phonon)
    )
    s_per_cm = ELEMENTARY_CHARGE_C * (electrons * electron_mobility + holes * hole_mobility)
    return MA_PER_V_UM_FROM_S_PER_CM * s_per_cm


# --- Mesh and forms -------------------------------------------------------------------------


def dolfin_mesh(points, triangles):
    """Return the dolfin mesh [um] of vertex and triangle arrays, in their order."""
    mesh = df.Mesh()
    editor = df.MeshEditor()
    editor.open(mesh, "triangle", 2, 2)
    editor.init_vertices(len(points))
    editor.init_cells(len(triangles))
    for number, point in enumerate(points):
        editor.add_vertex(number, point)
    for number, triangle in enumerate(triangles):
        editor.add_cell(number, triangle)
    editor.close()
    return mesh


def edge_markers(mesh, terminals):
    """Return an edge function with the tags of the terminals, 0 on all other edges."""
    mesh.init(1)
    edges = np.reshape(mesh.topology()(1, 0)(), (-1, 2))
    key_factors = (mesh.num_vertices(), 1)
    keys = np.sort(edges, axis=1) @ key_factors
    order = np.argsort(keys)
    markers = df.MeshFunction("size_t", mesh, 1, 0)
    for name, pairs in terminals.items():
        wanted = np.sort(pairs, axis=1) @ key_factors
        places = np.searchsorted(keys[order[:-1]], wanted)  # never past the end
        found = order[places]
        if not np.array_equal(keys[found], wanted):
            raise ValueError(f"terminal {name!r} has a vertex pair that is no edge of the mesh")
        markers.array()[found] = TERMINAL_TAGS.get(name, OTHER_END)
    return markers


def cell_markers(mesh, region, regions, tapered):
    """Return a cell function with HIGH_DOPED, or 1, 2, ... on the tapered regions in order."""
    tag_of = {int(name): HIGH_DOPED for name in regions}
    tag_of.update((int(name), tag) for tag, name in enumerate(tapered, start=1))
    markers = df.MeshFunction("size_t", mesh, 2, HIGH_DOPED)
    markers.array()[:] = [tag_of[number] for number in region]
    return markers


def coupled_forms(space, state, cells, tapered, material, thickness, quadrature_degree, past=()):
    """Return the residual [mW and mA] of both equations and its exact derivative.

    The laws of each material are integrated over their own cells only.  `tapered` lists the
    centre, axis and length of the tapered regions as dolfin constants, so that the compiled code
    serves every probe with the same number of them; or, for a region of any outline, its borders.
    In time `past` has, for the present and the last two states, the state and its weight [1/us] in
    the derivative of the enthalpy.
    """
    temperature, voltage = df.split(state)
    temperature_test, voltage_test = df.TestFunctions(space)
    dx = df.Measure(
        "dx",
        domain=space.mesh(),
        subdomain_data=cells,
        metadata={"quadrature_degree": quadrature_degree},
    )
    position = df.SpatialCoordinate(space.mesh())
    kappa = thermal_conductivity(temperature, material)

    def balance(sigma, tag):
        current = sigma * df.grad(voltage)
        heating = df.inner(current, df.grad(voltage))
        integrand = (
            kappa * df.inner(df.grad(temperature), df.grad(temperature_test))
            - heating * temperature_test
            + df.inner(current, df.grad(voltage_test))
        )
        for known, weight in past:
            integrand += weight * enthalpy(df.split(known)[0]) * temperature_test
        return thickness * integrand * dx(tag)

    residual = balance(high_doped_conductivity(temperature, material), HIGH_DOPED)
    for tag, taper in enumerate(tapered, start=1):
        if isinstance(taper, dict):
            doping = bordered_doping(position, taper["borders_um"], material)
        else:
            centre, axis, length = taper
            doping = tapered_doping(df.dot(position - centre, axis), length, material)
        residual += balance(low_doped_conductivity(temperature, doping, material), tag)
    return residual, df.derivative(residual, state)


def terminal_dofs(component, edges, tag):
    """Return the degrees of freedom of one component of the state on a terminal."""
    on_terminal = df.DirichletBC(component, 0.0, edges, tag).get_boundary_values()
    return np.array(sorted(on_terminal), dtype=np.intc)


def mean_weights(space, edges, tag):
    """Return w such that w @ values is the mean potential on a terminal."""
    voltage_test = df.TestFunctions(space)[1]
    ds = df.Measure("ds", domain=space.mesh(), subdomain_data=edges)
    weights = df.assemble(voltage_test * ds(tag)).get_local()
    return weights / weights.sum()


def point_weights(space, point):
    """Return w such that w @ values is the temperature at a point [um].

    A point that is a node gets the value of that node, without any search for a cell.
    """
    dofs = np.array(space.sub(0).dofmap().dofs())
    distances = np.hypot(*(space.tabulate_dof_coordinates()[dofs] - point).T)
    if distances.min() < 1e-9:
        weights = np.zeros(space.dim())
        weights[dofs[distances.argmin()]] = 1.0
        return weights
    vector = df.Function(space).vector()
    df.PointSource(space.sub(0), df.Point(*point), 1.0).apply(vector)
    return vector.get_local()


# --- The solver -----------------------------------------------------------------------------


class Lever:
    """The coupled problem of one probe, and the state from which the next bias point starts."""

    def __init__(self, problem, strategy):
        self.strategy = strategy
        """Build mesh, space, forms and linear solver from the problem dictionary."""
        mesh = dolfin_mesh(problem["points_um"], problem["triangles"])
        regions = problem["regions"]
        tapered = [name for name, region in regions.items() if region["doping"] != "high"]
        cells = cell_markers(mesh, problem["region"], regions, tapered)
        edges = edge_markers(mesh, problem["terminals"])
        element = df.VectorElement("P", mesh.ufl_cell(), problem["degree"], dim=2)
        space = df.FunctionSpace(mesh, element)
        self.state = df.Function(space)

        self.past = []
        if "times_us" in problem:
            states = [self.state, df.Function(space), df.Function(space)]
            self.past = [(one, df.Constant(0.0)) for one in states]
            for one in states:  # never 0 K, even where its weight is zero
                one.vector()[:] = problem["circuit"]["base_temperature_K"]
        self.material = {name: df.Constant(problem["material"][name]) for name in MATERIAL_NAMES}
        residual, jacobian = coupled_forms(
            space,
            self.state,
            cells,
            [
                regions[name]
                if regions[name]["doping"] == "bordered"
                else [df.Constant(regions[name][key]) for key in ("centre_um", "axis", "length_um")]
                for name in tapered
            ],
            self.material,
            df.Constant(problem["thickness_um"]),
            problem["quadrature_degree"],
            self.past,
        )
        self.residual_form = df.Form(residual)
        self.jacobian_form = df.Form(jacobian)

        self.temperature_dofs = np.array(space.sub(0).dofmap().dofs())
        self.end_dofs = np.unique(
            np.concatenate(
                [
                    terminal_dofs(space.sub(0), edges, tag)
                    for tag in (SUPPLY, GROUND, READER, OTHER_END)
                ]
            )
        )
        self.supply_dofs = terminal_dofs(space.sub(1), edges, SUPPLY)
        self.ground_dofs = terminal_dofs(space.sub(1), edges, GROUND)
        self.fixed_dofs = np.concatenate([self.end_dofs, self.supply_dofs, self.ground_dofs])
        self.tip_weights = point_weights(space, problem["tip_um"])
        self.reader_weights = None
        if "reader" in problem["terminals"]:
            self.reader_weights = mean_weights(space, edges, READER)

        self.series_kohm = problem["circuit"]["series_resistance_ohm"] / 1e3
        self.cold = np.zeros(space.dim())
        self.cold[self.temperature_dofs] = problem["circuit"]["base_temperature_K"]
        self.kelvin_per_unit = np.full(space.dim(), KELVIN_PER_VOLT)
        self.kelvin_per_unit[self.temperature_dofs] = 1.0

        self.matrix = df.PETScMatrix()
        self.rhs = df.PETScVector()
        self.solution = self.state.vector().copy()
        self.unit_rise = self.state.vector().copy()  # 1 V on the supply terminal, 0 elsewhere
        indicator = np.zeros(space.dim())
        indicator[self.supply_dofs] = 1.0
        self.unit_rise[:] = indicator
        self.current_row = self.state.vector().copy()
        self.solver = None  # made with the first matrix
        self.iterations = 0
        self.factorisations = 0
        self.start({})

    def start(self, material):
        """Go back to zero bias, with some of the material values changed."""
        for name, value in material.items():
            self.material[name].assign(value)
        self.values = self.cold
        self.history = {0.0: self.values}  # bias [V] -> solution, the latest last
        self.is_stale = True

    def residual(self):
        """Return the residual [mW, mA] of the present values, fixed rows included.

        A fixed row holds what flows into the lever there: heat [mW] or current [mA].
        """
        self.state.vector()[:] = self.values
        df.assemble(self.residual_form, tensor=self.rhs)
        return self.rhs.get_local()

    def factorise(self):
        """Renew the Newton matrix, and the response of state and current to V_l."""
        df.assemble(self.jacobian_form, tensor=self.matrix)
        self.matrix.transpmult(self.unit_rise, self.current_row)
        self.current_slope = self.current_row.get_local()  # dI_h / du
        self.matrix.ident(self.fixed_dofs)
        if self.solver is None:
            self.solver = df.PETScLUSolver(self.matrix, self.strategy.lu_method)
            if self.strategy.lu_ordering:
                self.solver.ksp().getPC().setFactorOrdering(self.strategy.lu_ordering)
        self.solver.solve(self.solution, self.unit_rise)
        self.response = self.solution.get_local()  # du / dV_l
        self.is_stale = False
        self.factorisations += 1

    def newton_step(self, bias, residual):
        """Return the step that solves the linearised field and circuit equations together."""
        lever_voltage = self.values[self.supply_dofs[0]]
        current = residual[self.supply_dofs].sum()
        free = -residual
        free[self.fixed_dofs] = 0.0
        self.rhs[:] = free
        self.solver.solve(self.solution, self.rhs)
        step = self.solution.get_local()  # at fixed V_l
        current += self.current_slope @ step
        resistance_ratio = 1.0 + self.series_kohm * (self.current_slope @ self.response)
        rise = (bias - lever_voltage - self.series_kohm * current) / resistance_ratio
        return step + rise * self.response

    def limited(self, step):
        """Return the step, shortened where it exceeds the temperature limit."""
        longest = np.abs(step[self.temperature_dofs]).max()
        return step * min(1.0, STEP_LIMIT_K / max(longest, STEP_LIMIT_K))

    def iterate(self, bias):
        """Iterate from the present values at this bias [V]; return whether it converged."""
        previous_length = 0.0
        for iteration in range(1, MAX_ITERATIONS + 1):
            residual = self.residual()
            is_new = self.is_stale
            if is_new:
                self.factorise()
            step = self.newton_step(bias, residual)
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
            if length * rate < TOLERANCE_K * (1.0 - rate):
                return True
            previous_length = length
        self.is_stale = True
        return False

    def solve(self, bias):
        """Bring the values to the solution at this bias [V], by way of others if need be."""
        ahead = [bias]  # the next target last
        while ahead:
            last_bias, last_values = list(self.history.items())[-1]
            predicted = predicted_step(self.history, ahead[-1], self.strategy.predictor_points)
            self.values = last_values + self.limited(predicted)
            if self.iterate(ahead[-1]):
                reached = ahead.pop()
                self.history.pop(reached, None)
                self.history[reached] = self.values
            elif len(ahead) <= MAX_HALVINGS:
                ahead.append((last_bias + ahead[-1]) / 2.0)
            else:
                raise RuntimeError(
                    f"no convergence between a bias of {last_bias} and {ahead[-1]} V: with this "
                    "series resistance the state may not be a single-valued function of the bias"
                )

    def follow(self, bias, times, growth):
        """Switch the bias [V] on, and return the current and the tip temperature at times [us]."""
        stops = [FIRST_STEP * times[0]]
        for start, end in pairwise([*stops, *times]):
            between = max(1, int(np.ceil(np.log(end / start) / np.log(growth))))
            stops += [start * (end / start) ** (k / between) for k in range(1, between + 1)]
        last, now, found = self.cold, self.cold, []
        before, time = None, 0.0
        for stop in dict.fromkeys(stops):
            length = stop - time
            ratio = 0.0 if before is None else length / before
            weights = (1 + 2 * ratio) / (1 + ratio), -(1 + ratio), ratio**2 / (1 + ratio)
            for (_, constant), weight in zip(self.past, weights, strict=True):
                constant.assign(weight / length)
            for (state, _), known in zip(self.past[1:], (now, last), strict=True):
                state.vector()[:] = known
            self.values = now + ratio * (now - last)
            if not self.iterate(bias):
                raise RuntimeError(f"no convergence at {stop} us")
            last, now, before, time = now, self.values, length, stop
            if stop in times:
                current = self.residual()[self.supply_dofs].sum()
                found.append((current, self.tip_weights @ self.values))
        currents, tips = zip(*found, strict=True)
        return {"time_us": times, "current_mA": currents, "tip_K": tips, "steps": len(stops)}

    def sweep(self, bias_values):
        """Solve for each bias [V] in turn and return the lists of results."""
        rows = []
        for bias in bias_values:
            iterations_before, factorisations_before = self.iterations, self.factorisations
            self.solve(bias)
            residual = self.residual()
            current = residual[self.supply_dofs].sum()
            lever_voltage = self.values[self.supply_dofs[0]]
            has_reader = self.reader_weights is not None
            rows.append(
                {
                    "bias_V": bias,
                    "current_mA": current,
                    "lever_V": lever_voltage,
                    "reader_V": self.reader_weights @ self.values if has_reader else None,
                    "tip_K": self.tip_weights @ self.values,
                    "power_mW": lever_voltage * current,
                    "newton_iterations": self.iterations - iterations_before,
                    "factorisations": self.factorisations - factorisations_before,
                    "ground_current_mA": -residual[self.ground_dofs].sum(),
                    "heat_out_mW": -residual[self.end_dofs].sum(),
                }
            )
        return {name: [row[name] for row in rows] for name in rows[0]}


def predicted_step(history, bias, points):
    """Return the step to the polynomial in the bias through the latest points."""
    nodes = list(history)[-points:]
    step = -history[nodes[-1]]
    for node in nodes:
        others = [other for other in nodes if other != node]
        step = step + np.prod([(bias - o) / (node - o) for o in others]) * history[node]
    return step


def warm_up(problem):
    """Compile and load all generated code by solving the same problem on two triangles."""
    edges = {"supply": [[3, 0]], "ground": [[1, 2]], "reader": [[0, 1]]}
    tiny = dict(
        problem,
        points_um=[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles=[[0, 1, 2], [0, 2, 3]],
        region=[problem["region"][0]] * 2,
        terminals={name: edges[name] for name in edges if name in problem["terminals"]},
        tip_um=[0.5, 0.5],
    )
    Lever(tiny, TUNED).sweep([0.0])


def prepare(problem):
    """Choose the back end, and compile the generated code."""
    df.set_log_level(df.LogLevel.ERROR)
    df.parameters["linear_algebra_backend"] = "PETSc"
    df.parameters["form_compiler"]["representation"] = "uflacs"
    df.parameters["form_compiler"]["optimize"] = True
    df.parameters["form_compiler"]["cpp_optimize"] = True
    df.parameters["form_compiler"]["cpp_optimize_flags"] = "-O3"
    warm_up(problem)


def solve_problem(problem, strategy):
    """Return the result dictionary; the compilation of generated code is not timed."""
    prepare(problem)
    start, used = time.perf_counter(), time.process_time()
    lever = Lever(problem, strategy)
    if "times_us" in problem:
        result = lever.follow(problem["bias_V"][0], problem["times_us"], problem["growth"])
    else:
        result = lever.sweep(problem["bias_V"])
    seconds, used = time.perf_counter() - start, time.process_time() - used
    return {
        **result,
        "unknowns": len(lever.values),
        "seconds": seconds,
        "processor_seconds": used,
        "seconds_per_point": seconds / len(problem["bias_V"]),
        "dolfin_version": df.__version__,
    }


def serve(problem, strategy):
    """Answer lines of material values with lines of results; the first line says it is ready."""
    prepare(problem)
    lever = Lever(problem, strategy)
    print(json.dumps({"unknowns": len(lever.values)}), flush=True)
    for line in sys.stdin:
        began = time.process_time()
        lever.start(json.loads(line))
        try:
            result = lever.sweep(problem["bias_V"])
        except RuntimeError as error:
            result = {"error": str(error)}
        result["processor_seconds"] = time.process_time() - began
        print(json.dumps(result), flush=True)


def main():
    """Solve a problem file and write the result file, or serve."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("problem", help="PROBLEM.json")
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("-o", "--output", help="RESULT.json")
    action.add_argument("--serve", action="store_true", help="answer lines of material values")
    parser.add_argument("--plain", action="store_true", help="solve as dolfin's NewtonSolver does")
    arguments = parser.parse_args()
    with open(arguments.problem, encoding="utf-8") as file:
        problem = json.load(file)
    strategy = PLAIN if arguments.plain else TUNED
    if arguments.serve:
        serve(problem, strategy)
        return
    result = solve_problem(problem, strategy)
    with open(arguments.output, "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)


if __name__ == "__main__":
    main()
