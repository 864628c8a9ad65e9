"""A system of discs, shafts and gears, referred to the speed of one of its discs.

Discs that gears couple rigidly turn as one: theta_b = i_b theta with the speed ratio i_b to the
crank. With theta = theta_b/i_b as unknown, the energies J theta_b'^2/2 and k (theta_b' -
theta_a)^2/2 of equal theta keep their values if everything behind the gear is referred: i^2 J,
i^2 k, i^2 c, and i times a torque. So gears leave a system of *nodes* (a disc, or discs in mesh)
and shafts. Where these form a tree, numbered so that each node comes after its parent, the
equations are solved by elimination from its ends in as many steps as there are nodes.

Besides, stiffness and nominal stress of round shafts, and limits of propulsion shafts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from engine_dyn.given_numbers import given_array
from engine_dyn.types import Floats, Integers
from engine_dyn.units import MPA

MOST_DISCS = 64  # Largest number of discs of a system; ships' shafts have some 30


@dataclass(frozen=True, eq=False)
class ShaftSystem:
    """A shaft system referred to the crank, made by `shaft_system`.

    N discs on M nodes; S shafts, each of which lies between a node and its parent. Arrays of values
    have the designs as leading axes.
    """

    shafts: Integers  # First and second disc of each shaft; shape (S, 2)
    # Node of each disc (N,); node below each shaft (S,), whose other node is its parent.
    node_of_disc: Integers
    node_of_shaft: Integers
    # Speed of each disc over the crank's, negative where it turns the other way; shape (..., N)
    ratio: Floats
    # Torque of a shaft over the referred torque k* (theta_node - theta_parent); shape (..., S)
    shaft_factor: Floats
    # Parent of each node, earlier in the order; -1 for node 0, the crank's; shape (M,)
    parent: Integers
    # Referred inertia, damping, stiffness of nodes [kg m2, N m s/rad, N m/rad]; shape (..., M)
    inertia: Floats
    disc_damping: Floats
    ground_stiffness: Floats
    # Referred values of the shaft to each node's parent; 0 for node 0; shape (..., M)
    stiffness: Floats
    loss_factor: Floats
    damping: Floats
    speed_stiffness: Floats
    # Damping ratio of elastic modes from the lowest, beside all other damping; the last one is that
    # of all higher modes. Shape (..., n), n = 0 without.
    modal_damping: Floats

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the designs."""
        return self.inertia.shape[:-1]

    def mapped(self, change: Callable[[Floats], Floats]) -> ShaftSystem:
        """Return a system whose arrays of values are those that a function makes of them."""
        names = {one.name for one in fields(self)}
        names -= {"shafts", "node_of_disc", "node_of_shaft", "parent"}
        own: dict[str, Any] = {name: change(getattr(self, name)) for name in names}
        return replace(self, **own)

    def of(self, which: Any) -> ShaftSystem:
        """Return some of the designs, which lie along one axis."""
        return self.mapped(lambda values: values[which])

    def along_one_axis(self) -> ShaftSystem:
        """Return the same designs along one axis."""
        return self.mapped(along_one_axis)

    def stiffness_at(self, speed: Any) -> Floats:
        """Stiffness of the shafts to the parents with the crank at a speed [rad/s]."""
        turns = np.asarray(speed, dtype=float)[..., None]
        return np.asarray(self.stiffness + self.speed_stiffness * turns**2)


def shaft_system(
    inertia: Any,
    stiffness: Any,
    shafts: Sequence[tuple[int, int]] | None = None,
    *,
    loss_factor: Any = 0.0,
    damping: Any = 0.0,
    speed_stiffness: Any = 0.0,
    disc_damping: Any = 0.0,
    ground_stiffness: Any = 0.0,
    modal_damping: Any = (),
    meshes: Sequence[tuple[int, int]] = (),
    ratios: Any = 1.0,
    crank: int = 0,
    loose: bool = False,
) -> ShaftSystem:
    """Check a system of discs, shafts and gears, and refer it to the speed of one disc.

    Discs, shafts and meshes are numbered from 0. Values have their disc, shaft or mesh along the
    last axis; axes before it are designs, and broadcast. One number serves all.

    Parameters
    ----------
    inertia : array_like
        Inertia of each disc [kg m2]; of a crank throw with the mean of its reciprocating masses.
    stiffness : array_like
        Stiffness of each shaft [N m/rad]; 0 of a viscous damper.
    shafts : sequence of (int, int), optional
        Discs that each shaft joins; default: each disc to the next. A damper's ring, a coupling's
        half and a pendulum are discs, and what holds them is a shaft.
    loss_factor : array_like
        eta [1] of each shaft: steel, rubber. The relative damping psi of couplings is 2 pi eta.
    damping : array_like
        Viscous, in each shaft [N m s/rad].
    speed_stiffness : array_like
        Stiffness over the square of the crank's speed [kg m2]: see `shaft.pendulum`.
    disc_damping : array_like
        Viscous, from each disc to the frame [N m s/rad]; below 0 where what acts there drives the
        more, or brakes the less, the faster the disc turns.
    ground_stiffness : array_like
        Spring from each disc to the frame [N m/rad]: the synchronising torque of an alternator.
    modal_damping : array_like
        Damping ratio [1] of elastic modes from the lowest, which adds to all other damping; the
        last one is that of all higher modes. Over a dynamic magnifier M it is 1/(2 M).
    meshes : sequence of (int, int)
        Discs that turn in a fixed ratio.
    ratios : array_like
        Speed of the second disc of a mesh over that of the first; below 0 where it turns the other
        way, as two spur gears do: -R_first/R_second.
    crank : int
        Disc to whose speed orders and the referred values belong.
    loose : bool
        Whether shafts may hold nothing, such as dampers of some designs.

    Raises
    ------
    ValueError
        One line that names the place, the value and what is allowed.

    Examples
    --------
    >>> from engine_dyn.torsion.modes import natural_modes
    >>> two = shaft_system([211.4, 8.3], [9.775e6])
    >>> print(round(natural_modes(two).frequency[0], 3))  # Hz
    176.077
    """
    of_discs = given_array("inertia", inertia, finite=True)
    count = of_discs.shape[-1] if of_discs.ndim else 1
    if count > MOST_DISCS:
        raise ValueError(f"inertia: {count} discs: must be at most {MOST_DISCS}")
    pairs = [(i, i + 1) for i in range(count - 1)] if shafts is None else shafts
    joined, meshed = _pairs("shafts", pairs, count), _pairs("meshes", meshes, count)
    if not 0 <= crank < count:
        raise ValueError(f"crank = {crank}: must be a disc, from 0 to {count - 1}")
    size = len(joined)
    discs = {
        name: _values(name, value, count, "disc", low=low)
        for name, value, low in (
            ("inertia", of_discs, 0.0), ("disc_damping", disc_damping, -np.inf),
            ("ground_stiffness", ground_stiffness, 0.0),
        )
    }  # fmt: skip
    between = {
        name: _values(name, value, size, "shaft")
        for name, value in (
            ("stiffness", stiffness), ("loss_factor", loss_factor), ("damping", damping),
            ("speed_stiffness", speed_stiffness),
        )
    }  # fmt: skip
    of_modes = np.atleast_1d(given_array("modal_damping", modal_damping, finite=True))
    if not (of_modes >= 0.0).all():
        number = int(np.argwhere(~(of_modes >= 0.0))[0, -1])
        raise ValueError(f"modal_damping[{number}]: must be 0 or more")
    of_meshes = _values("ratios", ratios, len(meshed), "mesh", signed=True)
    holds = between["stiffness"] + between["speed_stiffness"] + between["damping"]
    if not (loose or np.all(holds > 0.0)):
        number = int(np.argwhere(~(holds > 0.0))[0, -1])
        raise ValueError(
            f"stiffness[{number}] = 0: must be above 0, unless damping[{number}] is, as in a "
            "viscous damper"
        )
    everything = (*discs.values(), *between.values(), of_meshes, of_modes)
    try:
        shape = np.broadcast_shapes(*(values.shape[:-1] for values in everything))
    except ValueError:
        raise ValueError("values of discs, shafts and meshes: designs do not broadcast") from None
    parent, nodes, below, ratio = _tree(joined, meshed, of_meshes, count, crank, shape)
    made = {name: np.zeros((*shape, len(parent))) for name in (*discs, *between)}
    for disc, node in enumerate(nodes):
        for name, values in discs.items():
            made[name][..., node] += ratio[..., disc] ** 2 * values[..., disc]
    factor = np.empty((*shape, size))
    for shaft, (_, second) in enumerate(joined):
        own = ratio[..., second]
        factor[..., shaft] = (1.0 if nodes[second] == below[shaft] else -1.0) / own
        for name, values in between.items():
            scale = 1.0 if name == "loss_factor" else own**2
            made[name][..., below[shaft]] = scale * values[..., shaft]
    if not np.all(made["inertia"] > 0.0):
        node = int(np.argwhere(~(made["inertia"] > 0.0))[0, -1])
        raise ValueError(
            f"inertia[{nodes.index(node)}] = 0: must be above 0, of a disc with what it meshes with"
        )
    made["modal_damping"] = np.broadcast_to(of_modes, (*shape, of_modes.shape[-1])).copy()
    for values in (*made.values(), ratio, factor):
        values.flags.writeable = False
    return ShaftSystem(
        np.array(joined, dtype=np.int64).reshape(-1, 2), np.array(nodes, dtype=np.int64),
        np.array(below, dtype=np.int64), ratio, factor, np.array(parent, dtype=np.int64), **made,
    )  # fmt: skip


def _pairs(name: str, pairs: Sequence[tuple[int, int]], discs: int) -> list[tuple[int, int]]:
    """Pairs of discs, after checks."""
    for number, pair in enumerate(pairs):
        if len(pair) != 2 or not all(disc in range(discs) for disc in pair):
            raise ValueError(
                f"{name}[{number}] = {tuple(pair)}: must be two discs, from 0 to {discs - 1}"
            )
    return [(int(first), int(second)) for first, second in pairs]


def _values(
    name: str, value: Any, size: int, kind: str, *, signed: bool = False, low: float = 0.0
) -> Floats:
    """Values, one for each item, along the last axis; none below `low` or, `signed`, none of 0."""
    values = given_array(name, value, finite=True)
    if values.ndim == 0:
        values = np.full(size, float(values))
    if values.shape[-1] != size:
        raise ValueError(f"{name}: {values.shape[-1]} values: must be {size}, one for each {kind}")
    wrong = values == 0.0 if signed else values < low
    if wrong.any():
        place = np.argwhere(wrong)[0]
        allowed = "not be 0" if signed else "not be below 0"
        raise ValueError(f"{name}[{place[-1]}] = {values[tuple(place)]:g}: must {allowed}")
    return values


def _tree(
    shafts: list[tuple[int, int]], meshes: list[tuple[int, int]], ratios: Floats, discs: int,
    crank: int, shape: tuple[int, ...],
) -> tuple[list[int], list[int], list[int], Floats]:  # fmt: skip
    """Parents of the nodes, node of each disc, node below each shaft, and ratios of the discs."""
    beside: list[list[tuple[int, int]]] = [[] for _ in range(discs)]
    group = list(range(discs))  # discs that the links so far join have one group
    for edge, (first, second) in enumerate([*shafts, *meshes]):
        if group[first] == group[second]:
            mesh = edge - len(shafts)
            name = f"shafts[{edge}]" if mesh < 0 else f"meshes[{mesh}]"
            raise ValueError(
                f"{name} = {(first, second)}: closes a loop: shafts and gears must be a tree"
            )
        group = [group[first] if one == group[second] else one for one in group]
        beside[first].append((edge, second))
        beside[second].append((edge, first))
    parent, node, below = [-1], [-1] * discs, [0] * len(shafts)
    ratio = np.ones((*shape, discs))
    node[crank], reached = 0, [crank]
    for disc in reached:  # the list grows during the loop
        for edge, other in beside[disc]:
            if node[other] >= 0:
                continue
            mesh = edge - len(shafts)
            ratio[..., other] = ratio[..., disc]
            node[other] = node[disc]
            if mesh < 0:
                node[other] = below[edge] = len(parent)
                parent.append(node[disc])
            elif meshes[mesh][0] == disc:
                ratio[..., other] *= ratios[..., mesh]
            else:
                ratio[..., other] /= ratios[..., mesh]
            reached.append(other)
    if -1 in node:
        raise ValueError(f"disc {node.index(-1)}: no shafts or meshes join it to disc {crank}")
    return parent, node, below, ratio


def along_one_axis(values: Floats, own: int = 1) -> Floats:
    """Values with all designs along one axis, before the last `own` axes.

    Read-only, as those of a system are: kernels are compiled anew for arrays that are not.
    """
    shape = math.prod(values.shape[:-own]), *values.shape[-own:]
    found = np.ascontiguousarray(values.reshape(shape)).view()
    found.flags.writeable = False
    return found


def matrices(system: ShaftSystem, speed: Any = 0.0) -> tuple[Floats, Floats, Floats, Floats]:
    """Referred inertia (..., M) and matrices (..., M, M): stiffness, its loss eta k, damping.

    So K* = stiffness + i loss + i nu omega damping. `speed` [rad/s] broadcasts with the designs.
    """
    stiffness = system.stiffness_at(speed)
    shape = stiffness.shape
    inertia = np.broadcast_to(system.inertia, shape)
    blocks = []
    for between, own in (
        (stiffness, system.ground_stiffness), (stiffness * system.loss_factor, 0.0),
        (system.damping, system.disc_damping),
    ):  # fmt: skip
        matrix = np.zeros((*shape, shape[-1]))
        diagonal = np.einsum("...ii->...i", matrix)
        diagonal += own
        for node, parent in enumerate(system.parent[1:].tolist(), 1):
            for one, other in ((node, parent), (parent, node)):
                matrix[..., one, one] += between[..., node]
                matrix[..., one, other] -= between[..., node]
        blocks.append(matrix)
    return inertia, blocks[0], blocks[1], blocks[2]


def mean_torques(system: ShaftSystem, torque: Any, load: int) -> Floats:
    """Mean torque in each shaft [N m], shape (..., S), from the mean torques on the discs.

    Parameters
    ----------
    system : ShaftSystem
        Its springs to the frame and its damping are taken to carry no mean torque.
    torque : array_like
        On each disc along the last axis [N m], positive in the sense of rotation of the crank; that
        on the load is ignored. NaN where it is not known: then the shafts' torques are not either.
    load : int
        Disc that takes up what the others give.
    """
    given = given_array("torque", torque)
    discs = system.node_of_disc.size
    if not given.ndim or given.shape[-1] != discs:
        raise ValueError(f"torque: must be {discs} values, one for each disc")
    if not 0 <= load < discs:
        raise ValueError(f"load = {load}: must be a disc, from 0 to {discs - 1}")
    referred = system.ratio * given
    referred[..., load] -= referred.sum(axis=-1)
    behind = np.zeros((*referred.shape[:-1], system.parent.size))
    for disc, node in enumerate(system.node_of_disc.tolist()):
        behind[..., node] += referred[..., disc]
    for node in range(system.parent.size - 1, 0, -1):
        behind[..., system.parent[node]] += behind[..., node]
    return np.asarray(system.shaft_factor * behind[..., system.node_of_shaft])


def shaft_stiffness(shear_modulus: Any, length: Any, diameter: Any, bore: Any = 0.0) -> Any:
    """Stiffness pi G (d^4 - d_b^4)/(32 l) [N m/rad] of a round shaft; arguments in Pa and m."""
    return np.pi * shear_modulus * (diameter**4 - bore**4) / (32.0 * length)


def shear_stress(torque: Any, diameter: Any, bore: Any = 0.0) -> Any:
    """Nominal shear stress 16 T d/(pi (d^4 - d_b^4)) [Pa] at the surface of a round shaft.

    Of the half range of the torque [N m] it is what rules of classification limit; notches are left
    out. Diameter and bore [m].
    """
    return 16.0 * torque * diameter / (np.pi * (diameter**4 - bore**4))


CARBON_STEEL, ALLOY_STEEL = 600.0 * MPA, 800.0 * MPA
"""Largest tensile strength that IACS UR M68 counts for vibratory stresses [Pa]."""


def propulsion_shaft_limits(
    speed_ratio: Any, diameter: Any, tensile_strength: Any, shape_factor: Any,
    most_strength: Any = CARBON_STEEL,
) -> tuple[Any, Any]:  # fmt: skip
    """Permissible vibratory stresses [Pa] of ships' propulsion shafts: continuous, and in passing.

    tau_C = (sigma_B + 160)/18 c_K c_D (3 - 2 lambda^2) below a speed ratio lambda of 0.9, and
    1.38 in place of the bracket from there to 1.05, that end included; tau_T = 1.7 tau_C/sqrt(c_K)
    up to 0.8, where the speed passes quickly; sigma_B and the stresses in N/mm2,
    c_D = 0.35 + 0.93 d^-0.2 with d in mm. NaN where the rule gives no value. The limits hold for
    the half range of the synthesis of all orders, nominal, plain section.

    Parameters
    ----------
    speed_ratio : array_like
        lambda, speed over rated speed [1].
    diameter : array_like
        Diameter of the shaft [m].
    tensile_strength : array_like
        Specified minimum [Pa].
    shape_factor : array_like
        c_K [1]: 1 for integral flanges and shrink fits, 0.6 for a keyway in a taper, 0.45 in a
        cylinder, 0.5 at a radial hole, 0.3 at a longitudinal slot; 0.85 for thrust shafts at the
        collar or the axial bearing; 0.55 for propeller shafts at the propeller, from its bearing
        on, and 0.8 for the part of them before that bearing.
    most_strength : array_like
        The strength that counts at most [Pa]: 600 MPa of carbon and carbon-manganese steel and
        of propeller shafts, 800 MPa of other shafts of alloy steel.

    Notes
    -----
    IACS UR M68, which does not hold for crankshafts (M53) and shafts of gears and generators.
    c_D, the half range and some of c_K were compared with Lloyd's Register, Rules for Naval Ships,
    Vol. 2 Part 5 Ch. 1 Sec. 3. The rest is general knowledge of the rule, not compared with its
    text: read that before you rely on it.
    """
    ratio = np.asarray(speed_ratio, dtype=float)
    size = 0.35 + 0.93 * (1000.0 * np.asarray(diameter)) ** -0.2
    strength = np.minimum(tensile_strength, most_strength)
    base = (strength / MPA + 160.0) / 18.0 * shape_factor * size * MPA
    bracket = np.where(ratio < 0.9, 3.0 - 2.0 * ratio**2, 1.38)
    continuous = base * np.where((ratio > 0.0) & (ratio <= 1.05), bracket, np.nan)
    passing = np.where(ratio <= 0.8, 1.7 * continuous / np.sqrt(shape_factor), np.nan)
    return continuous, passing


def barred_range(critical_speed: Any, rated_speed: Any) -> tuple[Any, Any]:
    """Lower and upper edge of the range of speeds that IACS UR M68 bars around a critical speed.

    16 n_c/(18 - lambda) <= n <= (18 - lambda) n_c/16, lambda = n_c/n_rated, in the unit of the
    speeds. It holds where the continuous limit of `propulsion_shaft_limits` is exceeded there, up
    to lambda = 0.8; NaN above. General knowledge of the rule, not compared with its text: read
    that before you rely on it.

    Examples
    --------
    >>> low, high = barred_range(50.0, 100.0)
    >>> print(round(low, 2), round(high, 2))
    45.71 54.69
    """
    ratio = np.asarray(critical_speed) / rated_speed
    width = np.where(ratio <= 0.8, (18.0 - ratio) / 16.0, np.nan)
    return critical_speed / width, critical_speed * width
