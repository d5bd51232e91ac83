"""Where things stand in the arrays of the spline step.

State and forces are arrays of vectors. A vector of a rail's array has the *lanes* (train, rail) of one chunk of trains:
lane 2 t + r is rail r of the chunk's train t; 2 lanes for one train, 4 or 8 for more. A vector of a slab's array has
eight *slots* (slabs in memory) of one train; a vector of a vehicle's array eight coordinates of one car.

    rail[(chunk (n + 6) + 3 + i) RAIL_ROWS + 5 row + field]     function i, 3 zero functions at either end
    slab[((train groups + group) (N + 2 K) + K + i) SLAB_ROWS + row]     coordinate i, K zero coordinates at either end
    car[((train cars + car) CAR_ROWS + row) blocks + block]     coordinate 8 block + lane
"""

W, THETA_Y, V_LATERAL, THETA_Z, THETA_X = range(5)
"""Fields of a rail, in this order; the first two are the vertical block, the others the lateral one."""

# Rows of rails, slabs and cars: at t_n between steps, the iterate at t_{n+1} within one; the predictors;
# -(C v~ + K u~), for cars the acceleration that it makes.
U, V, A, U_PREDICTED, V_PREDICTED, LINEAR = range(6)

# Rails only: the forward result, then forces on w, v and theta_x of the seats (three fields, so it comes last).
FORWARD_RESULT, SEAT_LOAD = 6, 7
RAIL_ROWS = 7 * 5 + 3
LOAD_W, LOAD_V, LOAD_X = 35, 36, 37

# Slabs only: the forward result, the right-hand side, and k u + c v as their fastenings feel it.
SLAB_FORWARD, SLAB_LOAD, SLAB_PULL, SLAB_ROWS = 6, 7, 8, 9

# Cars only: the forces beyond the linear ones.
CAR_LOAD, CAR_ROWS = 6, 7

# Bands of a rail: a function couples with itself and three neighbours on either side.
REACH = 3
NEIGHBOURS = 2 * REACH + 1
STIFFNESS_PAIRS = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2), (2, 3), (3, 2), (3, 3), (4, 4))  # (row, column) of K
DAMPING_PAIRS = ((0, 0), (1, 1), (2, 2), (3, 3), (4, 4))  # of C: convection, and damping in proportion to mass
STAND_IN_PAIRS = ((0, 0), (2, 2), (2, 4), (4, 2), (4, 4))  # of A_s: seats act on w, v, theta_x

# A function's coefficients, one after another. L by rows: what couples with the fields before it in the same
# function, nearest first, then with the three functions before it, nearest field first. U the same way backwards,
# divided by its diagonal. K and C by neighbour: STIFFNESS_PAIRS, then DAMPING_PAIRS. A_s by neighbour.
FORWARD_START = (0, 6, 13, 22, 32)
N_FORWARD = 43
LINEAR_START = N_FORWARD
N_STIFFNESS, N_DAMPING = len(STIFFNESS_PAIRS), len(DAMPING_PAIRS)
N_LINEAR = N_STIFFNESS + N_DAMPING
STAND_IN_START = LINEAR_START + NEIGHBOURS * N_LINEAR
N_STAND_IN = len(STAND_IN_PAIRS)
BACKWARD_AT = STAND_IN_START + NEIGHBOURS * N_STAND_IN
BACKWARD_START = (6, 0, 32, 22, 13)  # of w, theta_y, v, theta_z, theta_x after BACKWARD_AT
INVERSE_DIAGONAL = BACKWARD_AT + N_FORWARD
N_COEFFICIENT = INVERSE_DIAGONAL + 5

# One-sided rows and columns of a wheel, per function: rows of (value, slope) of w against two fields, of v and theta_x
# against three; columns of forces on w (two fields), v and theta_x (three each).
WHEEL_ROWS, WHEEL_COLUMNS, N_WHEEL_FUNCTION = 0, 16, 24

# Entries of ``size`` (int32).
(
    CHUNKS,
    FUNCTIONS,  # n
    SEATS,
    GROUPS,  # of eight slots, of a train
    SLAB_DOFS,  # N
    CARS,
    CAR_DOFS,  # coordinates of a car
    ELEMENTS,  # nonlinear suspension elements
    PASSES,
    LOAD_STEP,  # vectors from a step's row of loads to the next step's, 0 if all have the same
    LOAD_TRAIN,  # from a train's rows to the next train's
    LOAD_GROUND,  # from a row's first vector to the ground's accelerations, where it moves
    N_SIZE,
) = range(13)

# Entries of ``job`` (int32): what a launch does; with LOOK_EVERY > 0 it looks at the state every so many steps, of
# which STEPS_BEFORE lie before the chunk, and stops where a guard must check it, with LOOK_ALWAYS at the first look.
(FIRST_STEP, STEPS, STAGES, LOOK_EVERY, STEPS_BEFORE, LOOK_ALWAYS, N_JOB) = range(7)
SEATS_STAGE, PULL_STAGE, EXCHANGE_STAGE, SEAT_FORCE_STAGE = 1, 2, 4, 8
FORWARD_STAGE, CONTACT_STAGE, BACKWARD_STAGE, SLAB_STAGE, CAR_STAGE, PREDICT_STAGE = 16, 32, 64, 128, 256, 512
ALL_STAGES = 1023

# Limits of a sound state: sums of squares of coordinates, rates, second rates; a wheel's lateral shift, tilt, and shift
# the other way.
(SQUARES, LARGEST_SHIFT, LARGEST_TILT, SMALLEST_SHIFT, N_LIMITS) = (0, 3, 4, 5, 6)

# Columns of a span of the knots: rear and front end [m], four functions' c0..c3 in s - rear end, the first's number.
SPAN_REAR, SPAN_FRONT, SPAN_POLYNOMIALS, SPAN_FIRST, N_SPAN = 0, 1, 2, 18, 19

# A seat touches at most so many functions.
TOUCHED = 8
# Numbers of a seat and function: shape, what u and v of w and theta_x pull, what u and v of v pull.
SHAPE, PULL_U, PULL_V, SIDE_U, SIDE_V, N_SEAT_SHAPE = range(6)
# Ints of a seat: functions it touches, where its slab is; MODELLED 0 stands on rigid ground.
TOUCH_FIRST, TOUCH_COUNT, SEAT_GROUP, SEAT_SLOT, SEAT_ROW, MODELLED, N_SEAT_PLACE = range(7)

# Five rows a seat in the slabs' numbers, seat by seat within each: w left and right, dw/dy left and right, y.
SLAB_SEAT_ROWS = 5

# Ints of a wheelset: first function of its rows and columns and their count, four functions' first, wheels coupled.
ROWS_FIRST, ROWS_COUNT, WHEEL_FIRST, COUPLED_FIRST, COUPLED_END, N_WHEEL_PLACE = range(6)
