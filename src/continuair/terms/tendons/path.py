"""Device code of the path of a tendon: its length, its turns, and their derivatives."""

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.errors import InputError
from continuair.kernels.flight import flight_code
from continuair.terms.tendons.route import Place, Route
from continuair.vehicle.strain import COMPONENTS
from continuair.vehicle.tendon_path import GEOMETRY


@dataclass(frozen=True)
class PathCode:
    """Path, a struct; path_of(y, flight, tendon); pulled_by(bends, path, tensions), with the forces
    on the bends of tensions that lengthen the path."""

    Path: Any
    path_of: Any
    pulled_by: Any


def path_code(numbers: Numbers, tree: Tree, route: Route, place: Place) -> PathCode:
    types = device_types(numbers, tree)
    Real, State, Bends = types.Real, types.State, types.Bends
    Flight, layout = flight_code(numbers, tree).Flight, types.layout
    many, first, pieces_of_one, rubs = len(route.counts), place.row, route.pieces, route.rubs
    own = [layout.of_section[section] for section in route.sections]
    widest = max(each.stop - each.start for each in own)
    PerStretch = wp.types.vector(many, Real)
    Columns = wp.types.matrix((many, widest), Real)
    zero, half = Real(0.0), Real(0.5)

    @wp.struct
    class Path:
        """Length and rate of length, of the whole and of each stretch; the derivatives of the
        lengths in the coordinates of their sections; the turn of the tendon before each stretch's
        middle [rad]."""

        length: Real
        speed: Real
        speeds: PerStretch
        turns: PerStretch
        columns: Columns

    @wp.func
    def begun(y: State, flight: Flight, start: int):
        return Path(), zero

    def and_stretch(before: Any, index: int) -> Any:
        """Return the function that adds a stretch; its second result is half the last turn."""
        section, count = route.sections[index], route.counts[index]
        offset, width = sum(route.counts[:index]), own[index].stop - own[index].start
        along = _stretch_code(numbers, tree, route, section)
        rate_at, unit_at = layout.bend_rate_of(section).start, own[index].start

        @wp.func
        def found(y: State, flight: Flight, start: int):
            out, turned = before(y, flight, start)
            part = along(y, flight, start + offset, count)
            speed = zero
            for j in range(width):
                out.columns[index, j] = part.columns[j]
                speed += part.columns[j] * y[rate_at + j] / flight.plant.unit[unit_at + j]
            out.length += part.length
            out.speed += speed
            out.speeds[index] = speed
            if wp.static(rubs):
                out.turns[index] = turned + half * part.turn
            return out, half * part.turn

        return found

    summed = begun
    for index in range(many):
        summed = and_stretch(summed, index)

    @wp.func
    def path_of(y: State, flight: Flight, tendon: int):
        out, _ = summed(y, flight, first + pieces_of_one * tendon)
        return out

    @wp.func
    def pulled_by(out: Bends, path: Path, tensions: PerStretch):
        return out

    def and_pull(before: Any, index: int) -> Any:
        start, width = own[index].start, own[index].stop - own[index].start

        @wp.func
        def found(out: Bends, path: Path, tensions: PerStretch):
            out = before(out, path, tensions)
            for j in range(width):
                out[start + j] = out[start + j] + tensions[index] * path.columns[index, j]
            return out

        return found

    for index in range(many):
        pulled_by = and_pull(pulled_by, index)
    return holding(PathCode, locals())


@cache
def _stretch_code(numbers: Numbers, tree: Tree, route: Route, section: int) -> Any:
    """Return the function of some pieces in a section: their length, turn and derivatives."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Real, vec3, State = types.Real, types.vec3, types.State
    Flight, layout = flight_code(numbers, tree).Flight, types.layout
    row_of, Row = code.row_reader(types.Row), types.Row
    own, y_at, highest = layout.of_section[section], layout.bend_of(section).start, route.highest
    strains = tree.kind_of(section).strains
    if not strains:
        raise InputError(
            "arm.tendon",
            f"passes a section of the kind {tree.kind_of(section).name}, whose strain is not known",
            "define strains in that kind",
        )
    width, unit_at, rubs, straight = own.stop - own.start, own.start, route.rubs, route.straight
    # Squared distance [m²] that no tendon has, in place of 0.
    helical, tiny = route.turns, Real(1e-30)
    Coordinates, Strain = (wp.types.vector(n, Real) for n in (width, len(COMPONENTS)))
    zero, one, two = Real(0.0), Real(1.0), Real(2.0)
    polynomial = elementary_code(numbers).polynomial
    # Of the angle φ between two disks, in φ²: 2 (1 - cos φ)/φ², what it lacks to 1 over φ², and
    # their derivatives.
    chords = [2.0 * (-1.0) ** k / factorial(2 * k + 2) for k in range(14)]
    lacks = [2.0 * (-1.0) ** k / factorial(2 * k + 4) for k in range(14)]
    chord_of, lack_of = (polynomial(terms[::-1]) for terms in (chords, lacks))
    chord_rate_of, lack_rate_of = (
        polynomial([k * term for k, term in enumerate(terms)][:0:-1]) for terms in (chords, lacks)
    )

    @wp.struct
    class Part:
        """Length [m], turn of the tendon [rad], and derivatives of the length in coordinates."""

        length: Real
        turn: Real
        columns: Coordinates

    @wp.func
    def strain_of(q: Coordinates, row: Row):
        return Strain()

    @wp.func
    def strain_rate_of(q: Coordinates, row: Row):
        return Strain()

    @wp.func
    def added(out: Coordinates, row: Row, slope: Strain):
        return out

    def and_strain(before: Any, column: int, component: int, first: int) -> Any:
        """Return the sum with a coordinate; first: column of its polynomial, -1 for a constant."""

        @wp.func
        def constant(q: Coordinates, row: Row):
            out = before(q, row)
            out[component] = out[component] + q[column]
            return out

        @wp.func
        def varying(q: Coordinates, row: Row):
            out = before(q, row)
            out[component] = out[component] + q[column] * row[first]
            return out

        return constant if first < 0 else varying

    def and_added(before: Any, column: int, component: int, first: int) -> Any:
        @wp.func
        def constant(out: Coordinates, row: Row, slope: Strain):
            out = before(out, row, slope)
            out[column] = out[column] + slope[component]
            return out

        @wp.func
        def varying(out: Coordinates, row: Row, slope: Strain):
            out = before(out, row, slope)
            out[column] = out[column] + slope[component] * row[first]
            return out

        return constant if first < 0 else varying

    for column, (component, order) in enumerate(strains):
        at = GEOMETRY + order - 1 if order else -1
        strain_of = and_strain(strain_of, column, component, at)
        added = and_added(added, column, component, at)
        if order:
            strain_rate_of = and_strain(strain_rate_of, column, component, at + highest)

    @wp.func
    def along(y: State, flight: Flight, first: int, count: int):
        q = Coordinates()
        for j in range(width):
            q[j] = y[y_at + j] / flight.plant.unit[unit_at + j]
        out = Part()
        for i in range(count + wp.min(flight.stride, 0)):
            row = row_of(flight.coefficients, flight.vehicle, first + i)
            e = strain_of(q, row)
            length = row[0]
            o = vec3(row[1], row[2], zero)
            d = vec3(row[3], row[4], zero)
            # Bend, twist, stretch and shear: turning κ and advance τ per length of the backbone.
            kappa = vec3(e[1], -e[0], -e[2])
            tau = vec3(e[4], e[5], -one - e[3]) + wp.cross(kappa, o) + d
            whole = wp.dot(tau, tau)
            square = whole
            # Half the derivatives of the squared length by τ and κ.
            by_tau = tau
            by_kappa = vec3()
            if wp.static(straight):
                # The chord of a curve with constant κ and τ, in its own axes.
                angle = length * length * wp.dot(kappa, kappa)
                along_axis = length * wp.dot(tau, kappa)
                chord = chord_of(angle)
                lack = lack_of(angle)
                square = chord * whole + lack * along_axis * along_axis
                rate = chord_rate_of(angle) * whole + lack_rate_of(angle) * along_axis * along_axis
                by_tau = chord * tau + lack * along_axis * length * kappa
                by_kappa = rate * length * length * kappa + lack * along_axis * length * tau
            size = wp.sqrt(square)
            by_tau = by_tau / size
            by_kappa = by_kappa / size
            slope = Strain(
                by_tau[2] * o[0] - by_kappa[1], by_tau[2] * o[1] + by_kappa[0],
                by_tau[0] * o[1] - by_tau[1] * o[0] - by_kappa[2], -by_tau[2],
                by_tau[0], by_tau[1],
            )  # fmt: skip
            out.length += length * size
            out.columns = added(out.columns, row, length * slope)
            if wp.static(rubs):
                g = strain_rate_of(q, row)
                turning = vec3(g[1], -g[0], -g[2])
                change = vec3(g[4], g[5], -g[3]) + wp.cross(turning, o) + wp.cross(kappa, d)
                if wp.static(helical):
                    # o'' = -ω² o + 2 ω d' z×o/d of an offset whose distance is d, ω its turning.
                    distance = wp.dot(o, o) + tiny
                    omega = (o[0] * d[1] - o[1] * d[0]) / distance
                    aside = two * omega * wp.dot(o, d) / distance
                    change = change - omega * omega * o + aside * vec3(-o[1], o[0], zero)
                advance = wp.sqrt(whole)
                unit = tau / advance
                bent = (change - wp.dot(unit, change) * unit) / advance + wp.cross(kappa, unit)
                out.turn += length * wp.sqrt(wp.dot(bent, bent))
        return out

    return along
