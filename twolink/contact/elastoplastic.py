"""The elasto-plastic contact law of a ball and a surface, one of which yields.

Three phases, as in D. B. Marghitu and J. Zhao, Impact of a multiple pendulum with a non-linear
contact force, Mathematics 8(8), 1202, 2020: elastic compression, elasto-plastic compression, and
elastic restitution from the deepest point to a residual depth. With 1/E* = Σ (1 − ν²)/E of both
bodies, the radius R of the ball, S_y and ν of the body that yields first, and the depth δ:

- C = 1.295 exp(0.736 ν) and the yield depth δ_y = (π C S_y / 2 E*)² R, where the force is
  F_y = 4/3 E* √R δ_y^{3/2} (R. L. Jackson and I. Green, A finite element study of elasto-plastic
  hemispherical contact against a rigid flat, Journal of Tribology 127, 343, 2005).
- Compression, with x = δ/δ_y: F = F_y x^{3/2}, Hertz's, up to x = 1.9, and from there
  F/F_y = exp(−x^{5/12}/4) x^{3/2} + 4 H_G/(C S_y) (1 − exp(−x^{5/9}/25)) x (the same).
- The mean pressure of full flow H_G/S_y = 2.84 − 0.92 (1 − cos(π a/R)) (R. L. Jackson,
  V. Krithivasan and W. E. Wilson, The pressure to cause complete contact between elastic-plastic
  sinusoidal surfaces, Journal of Engineering Tribology 222, 857, 2008), on a disk of the radius
  a = (π C S_y / 2 E*) R √(x (x/1.9)^B), B = 0.14 exp(23 S_y/E*) (Jackson and Green).
- The residual depth after a largest depth δ_m, with y = δ_m/δ_y:
  δ_r/δ_m = 1.02 (1 − ((y + 5.9)/6.9)^{−0.54}) (R. L. Jackson, I. Chusoipin and I. Green, A finite
  element study of the residual stress and deformation in hemispherical contacts, Journal of
  Tribology 127, 484, 2005). It is 0 at y = 1: without yielding there is no dent.
- Restitution: F = F(δ_m) ((δ − δ_r)/(δ_m − δ_r))^{3/2}, Hertz's law with the radius that makes the
  force continuous (R. L. Jackson, I. Green and D. B. Marghitu, Predicting the coefficient of
  restitution of impacting elastic-perfectly plastic spheres, Nonlinear Dynamics 60, 217, 2010).

The published fits of compression are discontinuous at x = 1.9: the force jumps by 7.5 % for ν = 0,
0.5 % for ν = 0.3 and −3.4 % for ν = 0.5. The jump is an event and is not smoothed. Elsewhere the
force is continuous. Between x = 1 and x = 1.9 compression follows Hertz's law and restitution does
not, so that the dissipated energy grows from zero.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from twolink.arithmetic import Scalar, cos, exp, fraction_in, sqrt
from twolink.contact.force_laws import Branch, Hertz, Phase, PlasticState
from twolink.errors import IntegrationError

# Compression follows Hertz's law up to this multiple of the yield depth.
_HERTZ_UP_TO = Fraction(19, 10)

# Of the fit of residual depths: its factor, and the sum, the scale and the exponent in its power.
_RESIDUAL = Fraction(102, 100), Fraction(59, 10), Fraction(69, 10), Fraction(-54, 100)

# π by a convergent of its continued fraction, to 1e-36: both whole numbers are exact in long
# doubles.
_PI = Fraction(2646693125139304345, 842468587426513207)


@dataclass(frozen=True)
class Material:
    """The parameters: E* (Pa), radius of the ball (m), S_y (Pa) and ν of the yielding body.

    All are numbers of one type. The constants of the fits are decimal fractions in that type, so
    that runs of different precisions do not share their rounding.
    """

    modulus: Scalar
    radius: Scalar
    strength: Scalar
    poisson: Scalar

    def _number(self, constant: Fraction | int) -> Scalar:
        """Return a constant in the type of the parameters."""
        return fraction_in(Fraction(constant), 0 * self.modulus)

    @cached_property
    def factor(self) -> Scalar:
        """C: the mean pressure at first yield is 2/3 C S_y."""
        factor, of_poisson = map(self._number, (Fraction(1295, 1000), Fraction(736, 1000)))
        return factor * exp(of_poisson * self.poisson)

    @cached_property
    def slope(self) -> Scalar:
        """π C S_y / 2 E*, the ratio of contact radius to ball radius at first yield."""
        return self._number(_PI) * self.factor * self.strength / (2 * self.modulus)

    @cached_property
    def stiffness(self) -> Scalar:
        """Hertz's K (N/m^{3/2})."""
        return hertzian(self.modulus, self.radius)

    @cached_property
    def yield_depth(self) -> Scalar:
        """δ_y (m)."""
        return self.slope * self.slope * self.radius

    @cached_property
    def yield_force(self) -> Scalar:
        """F_y (N)."""
        return self.stiffness * self.yield_depth * sqrt(self.yield_depth)

    @cached_property
    def flow_depth(self) -> Scalar:
        """1.9 δ_y (m), the end of Hertzian compression."""
        return self._number(_HERTZ_UP_TO) * self.yield_depth

    @cached_property
    def exponent(self) -> Scalar:
        """B, by which contact radii grow faster than by Hertz's law."""
        return self._number(Fraction(14, 100)) * exp(23 * self.strength / self.modulus)

    @cached_property
    def last_depth(self) -> Scalar:
        """The depth (m) up to which the fits hold: a < R, and dents are shallower than presses.

        It is that of float64 in all precisions, as it bounds the range of the law alone.
        """
        most = max(float(_HERTZ_UP_TO), min(self._as_wide, _as_deep()))
        return self.yield_depth * self._number(Fraction(most))

    @property
    def _as_wide(self) -> float:
        """The depth, in δ_y, at which the contact is as wide as the ball."""
        B, slope, up_to = float(self.exponent), float(self.slope), float(_HERTZ_UP_TO)
        return math.exp((B * math.log(up_to) - 2 * math.log(slope)) / (1 + B))

    @property
    def limit(self) -> str:
        """The condition that fails at `last_depth`."""
        if self._as_wide <= _as_deep():
            return "the contact radius must be smaller than the radius of the ball"
        return (
            "a dent must be shallower than the press that made it, which the published fit gives up"
            f" to {_as_deep():.0f} times the depth of first yield ({float(self.yield_depth):.3g} m)"
        )

    def contact_radius(self, depth: Scalar) -> Scalar:
        """Return a/R at a depth (m) beyond `flow_depth`."""
        x, B = depth / self.yield_depth, self.exponent
        return self.slope * self._number(1 / _HERTZ_UP_TO) ** (B / 2) * x ** ((1 + B) / 2)

    def flow_force(self, depth: Scalar) -> Scalar:
        """Return Jackson and Green's force (N) at a depth (m) beyond `flow_depth`."""
        x = depth / self.yield_depth
        most, drop, first, second = map(
            self._number,
            (Fraction(284, 100), Fraction(92, 100), Fraction(5, 12), Fraction(5, 9)),
        )
        hardness = most - drop * (1 - cos(self._number(_PI) * self.contact_radius(depth)))
        elastic = exp(-(x**first) / 4) * x**1.5
        plastic = 4 / self.factor * hardness * (1 - exp(-(x**second) / 25)) * x
        return self.yield_force * (elastic + plastic)

    def compression(self, depth: Scalar) -> Scalar:
        """Return the force (N) of a first compression to a depth (m), a plain number."""
        if depth < self.flow_depth:
            return self.stiffness * depth * sqrt(depth)
        return self.flow_force(depth)

    def residual(self, deepest: Scalar) -> Scalar:
        """Return the residual depth (m) after a largest depth (m) of at least δ_y."""
        part, offset, scale, power = map(self._number, _RESIDUAL)
        y = deepest / self.yield_depth
        return part * deepest * (1 - ((y + offset) / scale) ** power)


@functools.cache
def _as_deep() -> float:
    """Return the depth, in δ_y, at which a dent is as deep as its press by the published fit."""
    part, offset, scale, power = map(float, _RESIDUAL)
    return float(scale * (1 - 1 / part) ** (1 / power) - offset)


def hertzian(modulus: Scalar, radius: Scalar) -> Scalar:
    """Return Hertz's K = 4/3 E* √R (N/m^{3/2}) of a ball of a radius (m), in their type."""
    return 4 * modulus * sqrt(radius) / 3


@dataclass(frozen=True)
class Flow:
    """Jackson and Green's compression beyond Hertz's range."""

    material: Material
    uses_root = True
    relaxation = None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return the force (N)."""
        return self.material.flow_force(root * root)

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return the energy (J) that restitution from this depth returns."""
        given = self.force(depth, root, 0)
        return 2 * given * (depth - self.material.residual(depth)) / 5


@dataclass(frozen=True)
class ElastoPlastic:
    """The history dependence of the elasto-plastic law.

    An undamaged surface follows Hertz's law down to δ_y. Beyond it, restitution from the largest
    depth follows a curve that ends in a dent. A point that presses again follows the same curve
    down to the largest depth, and from there the first compression: between them the surface is
    elastic, and one branch. A point that has left the dent, above the undamaged surface, meets an
    undamaged surface when it returns, because it returns to another place.
    """

    material: Material

    def branch(self, dent: PlasticState) -> Branch:
        """Return the branch of the law for a dent."""
        material = self.material
        if dent.is_kept:
            return Branch(Hertz(dent.stiffness), dent.residual, sqrt(dent.deepest - dent.residual))
        if dent.phase is Phase.FLOWS:
            return Branch(Flow(material), reach=sqrt(material.last_depth), turning=1)
        hertz = Hertz(material.stiffness)
        if dent.phase is Phase.YIELDS:
            return Branch(hertz, reach=sqrt(material.flow_depth), turning=1)
        return Branch(hertz, reach=sqrt(material.yield_depth))

    def jump(self, dent: PlasticState) -> Scalar:
        """Return the depth (m) of the jump between both published fits, or that of their end."""
        beyond = dent.is_kept and bool(dent.deepest >= self.material.flow_depth)
        beyond = beyond or dent.phase is Phase.FLOWS
        return self.material.last_depth if beyond else self.material.flow_depth

    def pressed(self, dent: PlasticState) -> PlasticState:
        """Return the same dent."""
        return dent

    def reached(self, dent: PlasticState) -> PlasticState:
        """Return the dent when the point exceeds its largest depth, or the last one of a branch.

        Raises `IntegrationError` at the depth at which the published fits end.
        """
        if dent.phase is Phase.WHOLE or (
            dent.is_kept and bool(dent.deepest < self.material.flow_depth)
        ):
            return PlasticState(Phase.YIELDS)
        if dent.phase is Phase.FLOWS or self.material.last_depth <= self.material.flow_depth:
            raise self._out_of_range(self.material.last_depth)
        return PlasticState(Phase.FLOWS)

    def turned(self, dent: PlasticState, depth: Scalar) -> PlasticState:
        """Return the dent when the point turns at a depth (m) below the undamaged surface.

        Raises `IntegrationError` where the published fits do not describe a dent.
        """
        residual = self.material.residual(depth)
        if not (residual < depth and self.material.contact_radius(depth) < 1):
            raise self._out_of_range(depth)
        spring = depth - residual
        stiffness = self.material.compression(depth) / (spring * sqrt(spring))
        return PlasticState(Phase.DENTED, stiffness, residual, depth)

    def _out_of_range(self, depth: Scalar) -> IntegrationError:
        return IntegrationError(
            f"a ball of radius {float(self.material.radius):.6g} m is pressed {float(depth):.3g} m"
            f" deep, to the end of the range of the elasto-plastic law: {self.material.limit}"
        )
