"""Independent legacy-FEniCS solver of Joule-heated levers in vacuum.

    /usr/bin/python3 peer.py PROBLEM.json -o RESULT.json [--plain]
    /usr/bin/python3 peer.py PROBLEM.json --serve [--plain]

With --serve it keeps mesh and forms, and answers each line on standard input, a JSON dictionary of
parameters, with a line of results, until the input ends.

Solves, on a lever of films that lie on one another,

    -div(K(T) grad T) = S(x, T) |grad V|^2,      div(S(x, T) grad V) = 0,

where K and S are the sums of thickness times conductivity (laws.py); with thermoelectricity and
radiation (beyond.py), of films with Seebeck coefficients A,

    -div(K grad T + sum(A T I)) = I.grad V - e (T^4 - T_0^4),      div(I) = 0,

with I the sum of S (grad V + A grad T), the current turned round, and heat that leaves free edges
as well.  T is the base temperature on
every terminal, or what that terminal says; V = 0 at ground; no current passes sense contacts; and
the contact of each supply is an equipotential at an unknown V, fixed by what is behind it:
(V_b - V) / R_s = I, or a given current.

With "times_us" in the problem the bias, the first of "bias_V", is switched on at time zero, and the
enthalpy of silicon is stepped by the two-step backward differentiation formula, with steps that
grow by a given factor; the results are those at the times.

The state u = (T, V) lives in one two-component Lagrange space.  The Newton matrix is the exact UFL
derivative of the residual.  It is factorised anew only when the steps it gives stop shrinking fast
(the residual is always the exact one, so this costs no accuracy); with --plain, at every step.
Potentials of contacts are extra unknowns, eliminated exactly by bordering: one factorisation serves
the residual and a unit rise of each.  Currents are consistent fluxes, the residual of the charge
equation summed over a contact, so that charge and energy balance to rounding error.

Units throughout: um, K, V, mA, mW, kohm, which makes every equation free of conversion factors.
"""

import argparse
import json
import sys
import time

import dolfin as df
from in_time import follow

from lever import PLAIN, TUNED, Lever


def prepare(problem):
    """Choose the back end, and compile the generated code."""
    df.set_log_level(df.LogLevel.ERROR)
    df.parameters["linear_algebra_backend"] = "PETSc"
    df.parameters["form_compiler"]["representation"] = "uflacs"
    df.parameters["form_compiler"]["optimize"] = True
    df.parameters["form_compiler"]["cpp_optimize"] = True
    df.parameters["form_compiler"]["cpp_optimize_flags"] = "-O3"
    lever = Lever(problem, TUNED)
    lever.residual()
    lever.factorise()


def solve_problem(problem, strategy):
    """Return the result dictionary; the compilation of generated code is not timed."""
    prepare(problem)
    start, used = time.perf_counter(), time.process_time()
    lever = Lever(problem, strategy)
    if "times_us" in problem:
        result = follow(lever, problem["bias_V"][0], problem["times_us"], problem["growth"])
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
    """Answer lines of parameters with lines of results; the first line says it is ready."""
    prepare(problem)
    lever = Lever(problem, strategy)
    print(json.dumps({"unknowns": len(lever.values)}), flush=True)
    for line in sys.stdin:
        began = time.process_time()
        try:
            lever.start(json.loads(line))
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
    action.add_argument("--serve", action="store_true", help="answer lines of parameters")
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
