"""Every threshold of the hybrid simulator, with its unit, its reason and its readers.

A threshold "in roundings" is a multiple of the machine epsilon of the precision in use.
"""

# Part of the tolerance of a step, to which it is truncated: where more than rounding, states at
# events are known within this. Read by scales.
TRUNCATION = 2.0**-8

# Part of the depth of a damped surface. Closer to the depth at which it springs back at the speed
# of the point, the force has fallen to zero, and not jumped below it. Read by compliant_state.
NO_FORCE = 1e-9

# Roundings of a place, whose size is the larger of that of its coordinate (1 rad, or the length of
# the chain) and that of its bound. A start, given in float64, that is inside a contact by less is
# on it. Read by differences, doubted_changes, scales and start.
CONTACT_GAP = 64

# Roundings in float64 of the largest speed. A note says so if another order of simultaneous impacts
# changes u by more; a smaller change is round-off of the start. Read by impact_order.
NOTED = 2.0**20

# Gap, relative to the size of a place, of a contact that may have been struck before another one,
# and the error of an angle (rad) by which another event may have come before: as large as the
# coarsest accuracy. Read by event_order and impact_order.
CLOSING = 1e-3

# Roundings of a position, or of the terms of a speed. The place and the speed of a point that are
# computed from a scene in float64 are known within this: a start with a larger gap is open, and one
# with a larger speed slides. Points of a link that are as near are one. Read by complementarity,
# noise and start.
ROUNDED_PLACE = 8

# Roundings of the sum of all forces. A friction limit, a normal force or an acceleration that is
# smaller is zero within the precision, and the next derivatives decide. The factor
# covers the solution of two equations in a pose near a singular one. Read by doubts_of_jump,
# doubts_of_start, noise, impact, resolution, scales, singular_pose and start.
UNDECIDED = 2.0**20

# Roundings of the sum of all forces that the value of a law may have as it is computed. One that
# contradicts the law by more is decided in a longer precision, and one that does not exceed those
# of the forces that act may contradict it. Read by noise.
ROUNDED_VALUE = 64

# The part of an eigenvalue of a linearized motion below which its real part is none: two that are
# nearly equal have the square root of round-off. Read by leaving.
NO_GROWTH = 1e-6

# Roundings of the terms of a derivative of a linearized motion, below which it is zero: a direction
# of a chain is free of forces then. Read by leaving.
ROUNDED_SLOPE = 64

# Roundings of the terms of a speed. A smaller speed along a coordinate is zero within round-off.
# Read by impact.
AT_REST = 64

# Roundings of the speeds before an impact. A smaller speed after it is round-off of zero. Read
# by impact and jump.
LEFT_OVER = 64

# Roundings of the approach speed. A slower rebound counts as zero. Read by
# resolution.
NO_REBOUND = 512

# Part of the other row, or of the length of the chain. A shorter Jacobian row is the rounding of
# zero: the point cannot move that way in this pose. A scene is given in float64, so this is the
# same in all precisions. Read by impact, constraint, start, system and zeno.
NO_LEVER = 2.0**-46

# Part of the product of two rows. If their determinant is smaller, they are parallel. Also the
# angle (rad) by which forces must surround every direction. Read by constraint and grip.
PARALLEL = 1e-9

# Roundings of the terms of the response of a coordinate to a force, or of the determinant of two
# forces. A smaller one is round-off of zero: the terms are products of entries of rows and of an
# inertia, each of some roundings. Read by constraint.
NO_RESPONSE = 16

# Times the kinetic energy before. Newton's law of restitution with friction can create energy, near
# singular poses without a bound: an impact, or a burst, that gives more is refused. Read by
# resolution and zeno.
MOST_ENERGY = 1e6

# Impacts at one instant before those that answer each other are ended in their limit, which is rest
# of all contacts that take part, if they have taken energy. Read by resolution.
MOST_IMPACTS = 1000

# Jumps at one instant after which a run fails, as more would not end. A burst ends by itself after
# its impacts (below), and some slides may end or turn between two of them. Read by history.
MOST_JUMPS_AT_ONCE = 400

# Bounces on a contact before further ones are left out if they would not end. The run that judges
# another follows more of them. Read by effort.
PATIENCE = 1500

# Jumps before a run is given up: bounces without loss that a load presses on never end, and take a
# time that grows without bound as they grow lower. Read by effort and zeno.
MOST_JUMPS = 16_000

# Zeno times (below). After a flight that lasts longer the bounces do not die away at once, unless
# the restitution is below a thousandth: then one bounce more is simulated. Read by zeno.
LONG_FLIGHT = 1e3

# Share of the duration by which a run that measures another one goes beyond its failure, to see
# whether the laws themselves end there. Read by measure.
BEYOND = 0.01

# Difference of two runs (rad or rad/s) above which they follow different motions, and do not show
# any more how errors grow. A note names the event whose doubt changes the motion by more. Read by
# configurations, doubts, impact_order and judged.
SATURATED = 1e-3

# The part of the errors in double precision that those in long doubles may be. Round-off is a
# two-thousandth. An error that goes with its square root, like that of a contact that is hardly
# made, is a forty-fifth, and twice as much is stated. Read by configurations.
OF_DOUBLE = 0.05

# The same where bounces are omitted. The speed below which they are is a forty-fifth too, but the
# next one may be far below it or not. Read by configurations.
OF_BOUNCES = 0.2

# Least share of the duration from which the growth of errors is extrapolated, or by which the known
# part of a motion must have grown to count as longer. Read by configurations.
LEAST_SHARE = 0.01

# The least error (rad, rad/s) that shows whether errors fall with those of steps: smaller ones are
# round-off of results in float64. Read by configurations.
SHOWN = 1e-13

# Part of the larger rate of a clock at the ends of a step. Where it is slower a press ends, and a
# gap that is least there has not grazed. Read by doubts.
STANDING_CLOCK = 1e-6

# Jumps without an impact after which a run is given up if it would take as many times as many for
# the rest. Read by history.
MANY_JUMPS = 1_000

# Impacts within the Zeno time (below) before all contacts that took part come to rest together.
# Read by jump and zeno.
MOST_IMPACTS_OF_A_BURST = 60

# The part of the energy of its first impacts that the last ones of a burst have if it dies away:
# bursts of random scenes have less than 1e-3, and bounces without loss all of it. Read by zeno.
DYING = 0.01

# Impacts within the Zeno time of contacts that come to rest together if the laws admit no other
# motion. Read by zeno.
LEAST_IMPACTS_OF_A_BURST = 4

# The rate of Baumgarte's stabilisation of the positions and speeds of points that are held, times
# the longest step: no step is shorter for it. A joint that is held needs none. Read by scales.
STABILISATION = 4.0

# Part of the time. Shorter steps are not taken in any precision: the motion is asked for at times
# that are float64 numbers. Read by flow and steps_of_arc.
SHORTEST_STEP = 2.0**-42

# Steps of an arc after which it fails if it would take more than MOST_STEPS at the pace of the last
# ones. Read by flow.
MANY_STEPS = 2_000

# See MANY_STEPS. Read by flow.
MOST_STEPS = 1_000_000

# Part of the longest step. Only an arc, or a run, whose steps are shorter is given up for their
# number: a long motion takes many steps of the usual length. Read by effort, fastest_rate and flow.
SHORT_STEPS = 1e-3

# Times the duration of the last arc in the same mode. The first steps of the next one are at most
# as long, or SHORT_STEPS of the longest step: on a step that is far longer than the arc, the event
# functions have other roots beyond the event, and many halvings isolate it. Read by flow.
HORIZON = 8

# Part of the response of a normal to its own push. Where steps become too short while a point
# slides and friction leaves less of that response, friction locks the slide (Painlevé). Read by
# event_functions.
LOCKING = 1e-2

# Turn of a link (rad) in the longest step at a speed that counts as round-off where a slide comes
# to rest, or a mode holds an element: in thousands of each it was below 1e-10. Read by jump and
# reactions.
MOST_STOPPED = 1e-6

# Part of the momenta that the impulse of a locked slide may leave: none in the limit, where a
# push has no response, and more where links that turn cannot be stopped. Read by impact.
LEFT_BY_LOCKING = 0.1

# Part of a number of steps from which on the pace of the steps so far counts: a run is given up,
# and the code of a mode is optimised, if at this pace the number would be exceeded CERTAINLY times.
# Read by effort.
EARLY = 0.3

# See EARLY. Read by effort.
CERTAINLY = 2

# Longest time, in longest steps, for which a pressed surface is integrated in one arc, so that its
# variables, the clock among them, keep their relative accuracy. Read by flow.
LONGEST_PRESS = 64.0

# Roundings of the largest term. The values of a polynomial of an event function on a step are known
# within this. Read by bernstein and roots.
POLYNOMIAL = 16

# Roundings of an event function's size at the start of an arc, and of its derivatives in units of
# the longest step. Smaller leading coefficients are zero. Read by scales and start_of_arc.
LEADING = 256

# Roundings of all coefficients of an event function at the start of an arc: forces that nearly
# cancel leave round-off of this size in the leading ones. Read by start_of_arc.
LEADING_SHARE = 2048

# Roundings of a place. The error of a run may have turned a graze into a flight by this gap,
# so that a smaller one leaves a doubt. Read by scales.
GRAZING = 4096

# Scaled force, or speed (rad/s or m/s). A static friction limit, or the end of a slide under one,
# that comes as near leaves a doubt, which counts if the error of the run may bridge the distance.
# Read by doubts and ends_of_events.
NEAR_LIMIT = 0.1

# Roundings of a static limit. Limits that are reached within this at one instant are reached
# together, and of limits that are exceeded by factors within this the first counts. Read by
# breakaway_order, replayed_order and select.
SAME_LIMIT = 1024

# Events at one instant that are taken in every order: the one that ends an arc and the next ones.
# Read by event_order.
MOST_TOGETHER = 4

# Distance from the edge of a dent, relative to the size of a place, and of √depth from the end of a
# branch of a force law, relative to the root of that size. A point that comes as near leaves a
# doubt, which counts if the error of the run may bridge the distance: beyond the edge the surface
# is undamaged, and at the end a force may jump. Read by doubts.
NEAR_EDGE, NEAR_END = 1e-6, 1e-6

# Change of an angle (rad) or a speed (rad/s) for the derivatives of event functions, and part of
# the longest step for those in time. Read by replayed_order and steepness.
DIFFERENCE = 2.0**-20

# The least derivative of an event function (1/rad, 1/s) that such differences show. Read by doubts,
# edge_of_dent, ends_of_events and steepness.
FLAT = 2.0**-30

# Halvings of a step before a root that is not isolated counts as a double root. Read by roots.
MOST_HALVINGS = 60

# Pieces of a step that are looked at before those that are left count as double roots: where an
# event function hardly exceeds its round-off, halving decides nothing more. Read by roots.
MOST_PIECES = 1000

# Terms of the series by which undecided modes are distinguished. Read by confirm.
JET_ORDER = 6

# Part of the accelerations of a free chain. Modes whose accelerations differ by less are the same
# motion. Read by other_motions and replayed_order.
SAME_MOTION = 1e-6

# Roundings of the time, or of the longest step. A contact that is approached and closes within this
# is struck now: that changes the motion by a rounding only, even if a load turns it back before.
# Read by collision.
SAME_INSTANT = 1024

# Relative change of a state by some roundings, that of the accelerations by which is their
# round-off, and the least part of the accelerations that the residual of a step may be. On either
# side of a state loads may have other derivatives. Read by leaving and unseen.
CHANGED_STATE = 2.0**-46

# See CHANGED_STATE. Read by unseen.
LEAST_RESIDUAL = 2.0**-40


def zeno_time(longest_step: float, rounding: float) -> float:
    """Return the time (s) below which all further bounces are omitted.

    The sum of the bounces that remain, T, changes the state by terms of the order of T² once their
    impulses are replaced by those of rest: with T = h √ε for the longest step h, by rounding ε.
    Read by scales.
    """
    return float(longest_step) * rounding**0.5
