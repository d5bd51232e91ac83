"""Layout of the arrays that host and kernels share.

The motion of all trains is one array ``motion[row, i]``. A row is a copy of the generalised coordinates, a
column one coordinate: first the vertical rail blocks of all trains (train, rail, w_1..w_N, theta_y,1..N), then the
lateral ones (train, rail, v, theta_z, theta_x), the slabs (train, slot, DOF) and the vehicles (train, DOF). The train
is the outermost index of every block, so each block is a contiguous right-hand side for a matrix product.
"""

# Rows of ``motion``. The predictors are a product of rows U, V, A, the correctors one of A and the predictors.
U, V, A = 0, 1, 2  # displacement, velocity, acceleration: at t_n between steps, the iterate at t_{n+1} within one
U_PREDICTED, V_PREDICTED = 3, 4  # Newmark predictors of t_{n+1}
LINEAR = 5  # effect of C v + K u at the predictors: force -(C v + K u) of the rails, acceleration of slabs and vehicles
F = 6  # right-hand side of the implicit solve
MOTION_ROWS = 7

# Entries of ``dims`` (int32): sizes and offsets.
(
    TRAINS,
    MODES,
    SEATS,
    SLOTS,
    SLAB_DOFS,
    VEHICLE_DOFS,
    WHEELSETS,
    SEATS_PER_SLAB,
    LATERAL,  # offset of the lateral rail blocks
    SLABS,  # offset of the slab blocks
    VEHICLES,  # offset of the vehicle blocks
    BODIES,
    MORTAR_MODE,  # 0 bed wholly implicit, 1 only its no-tension deviation explicit, 2 wholly explicit
    CROSS_LEVEL_ROLLS,  # 1: a cross level turns the railheads, 0: it only shifts them
    N_DIMS,
) = range(15)

# Entries of ``constants`` (float64).
(
    DT,
    BETA_DT2,  # beta dt^2
    GAMMA_DT,  # gamma dt
    LENGTH,  # window [m]
    MASS,  # of the rail per length, then rho Iy, rho Iz, rho (Iy + Iz)
    INERTIA_Y,
    INERTIA_Z,
    INERTIA_X,
    K_VERTICAL,
    C_VERTICAL,
    K_LATERAL,
    C_LATERAL,
    ARM_FASTENING,  # a
    HALF_BASE,  # b
    SPACING,  # seat pitch d
    ARM_HEAD,  # h_r
    FRICTION,
    CROWN_OFFSET,  # y_r
    IRREGULARITY_HALF_BASE,  # b_i
    CONTACT_TOLERANCE,  # relative to the static wheel load
    STATIC_LOAD,
    TABLE_U0,
    TABLE_DU,
    TABLE_ALPHA0,
    TABLE_DALPHA,
    TABLE_ROWS,  # of one table, where wheels or rails differ
    SMEARED_VERTICAL,  # A_s: smeared fastenings of the implicit rail blocks, by mode [kg]
    SMEARED_LATERAL,
    RESIDUAL_VERTICAL,  # compliance of the truncated modes under a wheel in w, v, theta_x; zero if not added
    RESIDUAL_LATERAL,
    RESIDUAL_TORSION,
    ABSORBING_ZONE,  # length of the zones at the window's ends with more fastening, to the ground [m]
    N_CONSTANTS,
) = range(33)

# Columns of ``clock[step, :]`` (float64): the window at t_{n+1}.
(POSITION, SPEED, SPEED_RATE, FIRST_SEAT_S, FIRST_SEAT, FIRST_SLAB, N_CLOCK) = range(7)

# Entries of ``tick`` (int32): step, pass and record of a launch.
# LOAD_STEP and LOAD_TRAIN: numbers from a step's row of loads to the next step's, from a train's to the next train's.
(STEP, PASS, LAST_PASS, LOAD_STEP, LOAD_TRAIN, N_TICK) = range(6)

# Channels of the irregularity at a wheelset: track values and their slopes along x.
(Z_V, Y_A, CROSS_LEVEL, GAUGE, Z_V_SLOPE, Y_A_SLOPE, CROSS_LEVEL_SLOPE, GAUGE_SLOPE, N_IRREGULARITY) = range(9)

# With shapes of single rails or wheels out of round: heights of either rail and their slopes; then as the host gives
# them, how far the wheels' shapes have grown in, its derivative along x, the angle of rolling without slip on r0; or as
# the contact feels them, radius deviations of either wheel and their slopes along the wheel's path.
(RAIL_LEFT, RAIL_RIGHT, RAIL_LEFT_SLOPE, RAIL_RIGHT_SLOPE) = range(N_IRREGULARITY, N_IRREGULARITY + 4)
(GROWN, GROWN_SLOPE, TURNED, N_SHAPED) = range(N_IRREGULARITY + 4, N_IRREGULARITY + 8)
(WHEEL_LEFT, WHEEL_RIGHT, WHEEL_LEFT_SLOPE, WHEEL_RIGHT_SLOPE, N_FELT) = range(N_IRREGULARITY + 4, N_IRREGULARITY + 9)

# Numbers of a wheelset: r0, b0, spin inertia, tables of its wheels out of round (-1 for none). Where wheels or rails
# differ, also of either wheel its radius, how much larger that is than its table's, the crown offset of its rail, the
# first row of its contact table; else -1.
(NOMINAL_RADIUS, HALF_SPACING, SPIN_INERTIA, ROUND_LEFT, ROUND_RIGHT) = range(5)
(RADIUS_LEFT, RADIUS_RIGHT, LARGER_LEFT, LARGER_RIGHT) = range(5, 9)
(CROWN_LEFT, CROWN_RIGHT, ROW_LEFT, ROW_RIGHT, N_WHEEL_NUMBERS) = range(9, 14)

# Points of the table of a wheel out of round; the tables stand behind the numbers of ``constants``.
ROUND_POINTS = 4096

# Columns of the contact geometry table.
(GAP, S_WHEEL, S_RAIL, RADIUS, TAN_GAMMA, HERTZ, C11, C22, C23, C33, N_TABLE) = range(11)

# Output of a wheel; forces of the wheel on the rail in the track frame.
(
    NORMAL_FORCE,
    VERTICAL_FORCE,
    LATERAL_FORCE,
    LONGITUDINAL_CREEPAGE,
    LATERAL_CREEPAGE,
    SPIN_CREEPAGE,
    PENETRATION,
    POSITION_WHEEL,
    POSITION_RAIL,
    ROLLING_RADIUS,
    RAIL_DEFLECTION,
    LONGITUDINAL_CREEP_FORCE,
    LATERAL_CREEP_FORCE,
    SPIN_MOMENT,
    IRREGULARITY_VERTICAL,
    IRREGULARITY_LATERAL,
    RELATIVE_SHIFT,
    N_WHEEL,
) = range(18)

# Output of the patches of a wheel after its own, patch by patch, if it can have two; the angle in the track's frame.
(
    PATCH_NORMAL_FORCE,
    PATCH_POSITION_WHEEL,
    PATCH_POSITION_RAIL,
    PATCH_ANGLE,
    PATCH_LONGITUDINAL_CREEPAGE,
    PATCH_LATERAL_CREEPAGE,
    PATCH_SPIN_CREEPAGE,
    PATCH_LONGITUDINAL_CREEP_FORCE,
    PATCH_LATERAL_CREEP_FORCE,
    PATCH_SPIN_MOMENT,
    N_PATCH,
) = range(11)

CONTACT_ROWS = {1: 2, 2: 6}
"""Rows of a wheelset in the arrays of contact states and local forces, by the patches of a wheel: left and right wheel,
with two patches then left and right of the first and of the second. A wheel's forces are the sums over its patches, its
contact state is that of the patch with the larger normal force."""

N_WHEEL_RECORD = {1: N_WHEEL, 2: N_WHEEL + 2 * N_PATCH}
"""Length of a wheel's output, by its patches."""
