"""Layout of the numbers of a lane, which follows one return after another, and of the Taylor coefficients of a step.

States of the integrator are the displacement since the impact, the velocity, and the derivatives of both: first those of the
displacement by displacement, velocity and time (and along a direction of the parameters) at the beginning of the step, then those
of the velocity.
"""

# Floats of a lane: the last impact, the flight since then, the variance of its rounding errors, and the margins of the return
PHI, SPEED, VELOCITY, FLOWN, STEP_PHI, ELAPSED, PLACES, BOTH, VELOCITIES, CLEARANCE, SLOWEST = range(11)
BEFORE = 11  #: derivatives of speed and phase just before the last impact by those at the start and the parameters, row by row
SINCE = 17  #: of displacement and velocity at the beginning of the step, likewise
FLOATS = 23
WAYS = 3  #: by which derivatives are taken: speed, phase, and the direction of the parameters

# Integers of a lane: the row of its state, returns made, which wall was left, and the word so far
ROW, MADE, UP, FRESH, LETTER, RUN, CODE, POWER, TURNS, IMPACTS, STEPS, UNSURE, TURNED, RISING = range(14)
INTEGERS = 14

# Why a flight is undecided: values of UNSURE, the last reason of a return
SURE, GRAZES, CLOUDED, STEEP, STIFF = range(5)
