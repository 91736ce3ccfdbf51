"""Layout of the table of a system and of the coefficients of a flight, both plain arrays of floats.

The displacement since the start of a flight is d(s) = w s + sum of P_n s^n/n! + sum of Re(C_j r_j(s)) with complex rates
lambda_j, coefficients C_j = a_j - i b_j and r_j = exp(lambda_j s) - 1 - lambda_j s. P and C are linear in the features (1, z, w,
cos phi, sin phi, cos 2 phi, sin 2 phi, ...). Chains represent rates that are equal or nearly equal: their r_j are s^n exp(lambda
s)/n!, or a divided difference of two exponentials, without the first two terms.
"""

# The head of a table: walls, forcing, impact laws, the numbers of the parts, and where these begin
TOP, BOTTOM, PHASE_RATE, HORIZON, HAS_UP, HAS_DOWN, BASE_UP = range(7)
RESTITUTION, LAW, LAW_SLOPE, BALL_LAW = range(7, 15, 2)  #: two each, of the lower wall and of the upper; addresses of laws
HARMONICS, POWERS, SIMPLE, CHAINED, LOCAL, REACH, WIDE, DAMPED = range(15, 23)  #: DAMPED: coefficients depend on the velocity
AT_POWERS, AT_RATES, AT_TERMS, AT_CHAINS, AT_START, AT_PARAMETERS, FLIGHT_SIZE, HEAD = range(23, 31)
CHAIN = 4  #: more numbers of a chained rate:
CHAIN_POWER, DIFFERENCE_RE, DIFFERENCE_IM, LINKED = range(CHAIN)  #: the difference is that from the previous rate

# The features of a row in which coefficients are linear; cosine and sine of further harmonics of the phase follow
ONE, PLACE, VELOCITY, COSINE, SINE = range(5)

# The coefficients of one flight
SPEED, JERK, SNAP, CRACKLE, POP, ACCELERATION, DRIFT = range(7)  #: velocity at the start, and bounds
START_ACCELERATION, START_JERK, START_SNAP, START_CRACKLE, POLYNOMIAL = range(7, 12)
BEGIN = START_ACCELERATION  #: of the derivatives at the start
# from POLYNOMIAL on: the powers of s, from the second on, then two numbers of every rate


def features(harmonics: int) -> int:
    """The number of features in which coefficients are linear: 1, place, velocity, and the harmonics of the phase."""
    return 3 + 2 * harmonics
