"""Mesh, markers and weak forms of the peer."""

import dolfin as df
import numpy as np
import ufl
from beyond import black_emission, thermoelectric
from laws import LAWS, doping_in, enthalpy

NOTHING = ufl.zero(2)  # of a vector


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
    """Return an edge function: 1, 2, ... on the terminals in their order, 0 on all other edges."""
    mesh.init(1)
    edges = np.reshape(mesh.topology()(1, 0)(), (-1, 2))
    key_factors = (mesh.num_vertices(), 1)
    keys = np.sort(edges, axis=1) @ key_factors
    order = np.argsort(keys)
    markers = df.MeshFunction("size_t", mesh, 1, 0)
    for tag, (name, terminal) in enumerate(terminals.items(), start=1):
        wanted = np.sort(terminal["edges"], axis=1) @ key_factors
        places = np.searchsorted(keys[order[:-1]], wanted)  # never past the end
        found = order[places]
        if not np.array_equal(keys[found], wanted):
            raise ValueError(f"terminal {name!r} has a vertex pair that is no edge of the mesh")
        markers.array()[found] = tag
    return markers


def cell_markers(mesh, stack):
    """Return a cell function with the number of each triangle's stack."""
    markers = df.MeshFunction("size_t", mesh, 2, 0)
    markers.array()[:] = stack
    return markers


def conducts(stack, materials):
    """Return whether any film of a stack carries a current."""
    return any(LAWS[materials[film["material"]]["kind"]][1] for film in stack["films"])


def free_edges(mesh, problem):
    """Return an edge function: the number of the stack on edges that are no terminal, 0 inside.

    Numbers are one more than those of the stacks.
    """
    terminals = edge_markers(mesh, problem["terminals"])
    markers = df.MeshFunction("size_t", mesh, 1, 0)
    mesh.init(1, 2)
    for edge in df.facets(mesh):
        if edge.exterior() and not terminals[edge]:
            markers[edge] = 1 + problem["stack"][edge.entities(2)[0]]
    return markers


def film_forms(film, problem, materials, state, position):
    """Return kappa of a film, the current turned round, and the heat that it carries likewise.

    All are times the thickness, and vectors but kappa.
    """
    temperature, voltage = state
    material, stated = materials[film["material"]], problem["materials"][film["material"]]
    thickness = df.Constant(film["thickness_um"])
    heat, charge = LAWS[stated["kind"]]
    kappa = heat(temperature, material)
    if charge is None:
        return thickness * kappa, NOTHING, NOTHING
    doping = material.get("n_d")
    if "taper" in film:
        doping = doping_in(position, film["taper"], material, materials[film["dopant_from"]])
    sigma = thickness * charge(temperature, material, doping)
    if "thermoelectric" not in problem["physics"]:
        return thickness * kappa, sigma * df.grad(voltage), NOTHING
    seebeck, pairs = thermoelectric(stated, temperature, material, doping)
    current = sigma * (df.grad(voltage) + seebeck * df.grad(temperature))
    return thickness * (kappa + pairs), current, seebeck * temperature * current


def coupled_forms(space, state, cells, problem, parameters, past=()):
    """Return the residual [mW and mA] of both equations and its exact derivative.

    What lies on one another conducts side by side: sheet conductances add.  The laws of each stack
    are integrated over its own cells only.  `parameters` are dolfin constants by their names in
    the problem, so that the compiled code serves other values too.  In time `past` has, for the
    present and the last two states, the state and its weight [1/us] in the derivative of the
    enthalpy, which is that of silicon.
    """
    temperature, voltage = fields = df.split(state)
    temperature_test, voltage_test = df.TestFunctions(space)
    degree = {"quadrature_degree": problem["quadrature_degree"]}
    mesh, radiates = space.mesh(), "radiation" in problem["physics"]
    dx = df.Measure("dx", domain=mesh, subdomain_data=cells, metadata=degree)
    if radiates:
        edges = free_edges(mesh, problem)
        ds = df.Measure("ds", domain=mesh, subdomain_data=edges, metadata=degree)
    position = df.SpatialCoordinate(mesh)
    materials = {
        name: {own: parameters[full] for own, full in material["parameters"].items()}
        for name, material in problem["materials"].items()
    }
    residual = 0
    for tag, stack in enumerate(problem["stacks"]):
        films = [film_forms(film, problem, materials, fields, position) for film in stack["films"]]
        kappa, current, carried = (sum(terms[1:], terms[0]) for terms in zip(*films, strict=True))
        heat = kappa * df.grad(temperature) + carried
        balance = df.inner(heat, df.grad(temperature_test))
        balance += df.inner(current, df.grad(voltage_test))
        balance -= df.inner(current, df.grad(voltage)) * temperature_test
        thicknesses = [film["thickness_um"] for film in stack["films"]]
        for known, weight in past:
            balance += weight * sum(thicknesses) * enthalpy(df.split(known)[0]) * temperature_test
        residual += balance * dx(tag)
        if radiates:
            black = black_emission(temperature, problem["circuit"]["base_temperature_K"])
            grey = [materials[film["material"]]["emissivity"] for film in stack["films"]]
            edge = sum(e * t for e, t in zip(grey, thicknesses, strict=True))
            residual += (grey[0] + grey[-1]) * black * temperature_test * dx(tag)
            residual += edge * black * temperature_test * ds(1 + tag)
    return residual, df.derivative(residual, state)


def terminal_dofs(component, edges, tag):
    """Return the degrees of freedom of one component of the state on a terminal."""
    on_terminal = df.DirichletBC(component, 0.0, edges, tag).get_boundary_values()
    return np.array(sorted(on_terminal), dtype=np.intc)


def dofs_of_nothing(component, stack, is_conductor):
    """Return the degrees of freedom of the potential that no conductor touches."""
    dofmap, touched = component.dofmap(), set()
    for cell in np.flatnonzero(np.asarray(is_conductor)[stack]):
        touched.update(dofmap.cell_dofs(cell))
    return np.array(sorted(set(dofmap.dofs()) - touched), dtype=np.intc)


class Places:
    """Where fields and terminals are among the degrees of freedom, and the cold state.

    What is fixed is the temperature at all terminals, and the potential at contacts, at ground and
    where nothing conducts.
    """

    def __init__(self, space, problem, supplies):
        """Find them for a space, a problem and its supplies."""
        terminals, materials = problem["terminals"], problem["materials"]
        edges = edge_markers(space.mesh(), terminals)
        tags = {name: tag for tag, name in enumerate(terminals, start=1)}
        ends, contacts = (
            {name: terminal_dofs(space.sub(number), edges, tag) for name, tag in tags.items()}
            for number in (0, 1)
        )
        is_conductor = [conducts(stack, materials) for stack in problem["stacks"]]
        nothing = dofs_of_nothing(space.sub(1), problem["stack"], is_conductor)
        self.temperature_dofs = np.array(space.sub(0).dofmap().dofs())
        self.end_dofs = union(ends.values())
        self.contact_dofs = [np.setdiff1d(contacts[name], nothing) for name in supplies.names]
        self.ground_dofs = union(contacts[name] for name in supplies.grounds)
        self.fixed_dofs = union([self.end_dofs, *self.contact_dofs, self.ground_dofs, nothing])
        self.sense_weights = {
            name: mean_weights(space, edges, tags[name]) for name in supplies.senses
        }
        self.cold = np.zeros(space.dim())
        self.cold[self.temperature_dofs] = problem["circuit"]["base_temperature_K"]
        for name, terminal in terminals.items():
            if terminal["base_temperature_K"] is not None:
                self.cold[ends[name]] = terminal["base_temperature_K"]


def union(several):
    """Return all degrees of freedom of several arrays, each once."""
    return np.unique(np.concatenate([np.empty(0, dtype=np.intc), *several]))


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
