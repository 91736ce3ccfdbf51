"""Numbers of the engine that no formula gives, each with its reason."""

import math

TWO_PI = 2 * math.pi

# Rounding
ROUNDING = 1e-15  # relative: a few units in the last place of a double (2.2e-16)
ROUNDED = 1e-12  # by far more than the rounding errors of bounds and steps, which are sums of some ten terms
OUTWARD, INWARD = 1.0 + ROUNDED, 1.0 - ROUNDED  # factors by which bounds are enlarged, and steps shortened
AMBIGUOUS = 1e-10  # of the way flown: a flight whose gap may have a larger error is undecided
DEPTH = (
    16.0  # by twice this many errors an arc beyond the wall must be deeper than rounding: 2 of the formula, a factor 8 for safety
)
NO_SPEED = 1e-300  # a ball that leaves a wall slower than this stays on it: the reciprocal would overflow
NO_DIFFERENCE = 1e-100  # of two rates, over a time: the next term of the series is zero in doubles
FAR = 1e300  # a step longer than any horizon

# Coefficients of Taylor series: a product is cheaper than a division, and a float in vector instructions than an integer
THREE, FOUR, FOURTH = 3.0, 4.0, 0.25
THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0
OVER_24, OVER_120 = SIXTH * 0.25, SIXTH * 0.05

# The march to the first impact: estimates of a root's time that are certain to bound it
LATEST = 1.25  # times the estimate: before that a gap ahead must have closed
BRACKET = 1.5  # times the estimate: to there the single root is bracketed, and no other wall may be met
MOST_STEPS = 100_000  # of one flight; reached only by flights that stay close to a wall indefinitely

# Chatter and rest
STEADY = 1e-15  # radians of phase, by which the end of chatter may shift
SUMMED_JERK, SUMMED_SNAP = 1e-5, 1e-10  # relative change of the acceleration at which terms of third order are exact to rounding
INSTANT = 1e-13  # periods: a shorter rest is the rounding of a release
LATE = 1e-17  # periods: error of a release that is found in one more step
ROUND_THE_CIRCLE = 1.000001  # turns of the forcing, after which a ball that rests has met every force

# Returns
MOST_IMPACTS = 100_000  # of one return
INFINITE_CODE = 2**62  # no code of a word is larger
MOST_PHASE = 1e10  # radians, whose turns fit into an int32

# pi/2 and ln 2 in parts (W. Cody and W. Waite, Software manual for the elementary functions, 1980): integer multiples of the
# first parts, up to 2^20, are floats
QUARTER, QUARTER_1, QUARTER_2 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
DOUBLING, DOUBLING_1 = 0.6931471803691238, 1.9082149292705877e-10
OVER_QUARTER, OVER_DOUBLING = 0.6366197723675814, 1.4426950408889634  # 2/pi, 1/ln 2
FARTHEST = 709.0  # beyond, exp is infinite, or negligible beside one

# Minimax polynomials for |y| <= pi/4, of (sin y - y)/y^3 and (cos y - 1 + y^2/2)/y^4 in y^2, with errors of 3.3e-17 and 2.5e-18
SINE_3, SINE_5, SINE_7 = -0.16666666666666664621, 0.0083333333333309461029, -0.00019841269836754970014
SINE_9, SINE_11, SINE_13 = 2.755731610068302914e-6, -2.5051131455427947391e-8, 1.5918101230274120351e-10
COSINE_4, COSINE_6, COSINE_8 = 0.041666666666666665387, -0.0013888888888887395746, 0.000024801587298763433164
COSINE_10, COSINE_12, COSINE_14 = -2.7557317270560324065e-7, 2.0876146024689746601e-9, -1.1382614868556324578e-11
