"""One candidate from placement to verdict, as plain loops over small arrays.

Nothing here runs as it stands: :mod:`nlpweld.formulation.fused` compiles these functions in one module with the
kernels of a cell's graphs, which they call as ``grip``, ``limbs``, ``work``, ``gap`` and ``value``, with ``over_seam``,
which is one of the three below, and with the constants ``N`` (seam points), ``CLOSED``, ``NEAR``, ``GAP_SCALE_M`` and
``EXPONENT``. Everything a candidate needs fits the innermost
cache, nothing is written for it but its verdict, and what cannot change the verdict is not computed: these are the
steps of the array form (:mod:`~.staged`), one candidate at a time.
"""
# ruff: noqa: F821
# mypy: ignore-errors

from math import atan2, copysign, floor, inf, isfinite, isnan, nan, pi

import numpy as np


def least(values):
    """Return the least of an array; four at a time, for each comparison waits for the one before it."""
    low_0, low_1, low_2, low_3 = inf, inf, inf, inf
    for j in range(0, values.shape[0] - 3, 4):
        low_0, low_1 = min(low_0, values[j]), min(low_1, values[j + 1])
        low_2, low_3 = min(low_2, values[j + 2]), min(low_3, values[j + 3])
    for j in range(values.shape[0] - values.shape[0] % 4, values.shape[0]):
        low_0 = min(low_0, values[j])
    return min(min(low_0, low_1), min(low_2, low_3))


def greatest(values):
    """Return the greatest of an array."""
    high_0, high_1, high_2, high_3 = -inf, -inf, -inf, -inf
    for j in range(0, values.shape[0] - 3, 4):
        high_0, high_1 = max(high_0, values[j]), max(high_1, values[j + 1])
        high_2, high_3 = max(high_2, values[j + 2]), max(high_3, values[j + 3])
    for j in range(values.shape[0] - values.shape[0] % 4, values.shape[0]):
        high_0 = max(high_0, values[j])
    return max(max(high_0, high_1), max(high_2, high_3))


def lowest_end(ends):
    """Return the least height of a body's two ends over the seam."""
    low = inf
    for j in range(N):
        low = min(low, min(ends[j + 2 * N], ends[j + 5 * N]))
    return low


def any_near(a, i, b, j, bound):
    """Tell whether body i of one owner and body j of another come nearer than a bound at any seam point.

    What is near are the middles of their axes, from arrays (bodies * 3 * N,). This runs for every pair, so it takes
    whole arrays and unsigned offsets: a slice costs as much as the loop, and a signed index could count from the end.
    """
    near, step, twice = 0, np.uint64(N), np.uint64(2 * N)
    a_0, b_0 = np.uint64(3 * N * i), np.uint64(3 * N * j)
    for at in range(step):
        x = a[a_0 + at] - b[b_0 + at]
        y = a[a_0 + at + step] - b[b_0 + at + step]
        z = a[a_0 + at + twice] - b[b_0 + at + twice]
        near |= x * x + y * y + z * z < bound * bound
    return near != 0


def axes_near(a, b, bound):
    """Tell whether two axes, each (6 N,), may come nearer than a bound at any seam point.

    Two segments lie no nearer than their middles do, less what each extends towards the other.
    """
    near = 0
    for j in range(N):
        px, py, pz = a[j + 3 * N] - a[j], a[j + 4 * N] - a[j + N], a[j + 5 * N] - a[j + 2 * N]
        qx, qy, qz = b[j + 3 * N] - b[j], b[j + 4 * N] - b[j + N], b[j + 5 * N] - b[j + 2 * N]
        dx = a[j] - b[j] + 0.5 * (px - qx)
        dy = a[j + N] - b[j + N] + 0.5 * (py - qy)
        dz = a[j + 2 * N] - b[j + 2 * N] + 0.5 * (pz - qz)
        square = dx * dx + dy * dy + dz * dz
        along = abs(px * dx + py * dy + pz * dz) + abs(qx * dx + qy * dy + qz * dz)
        least_sq = square - 0.5 * along  # the least distance, times that of the middles
        near |= (least_sq < 0.0) | (least_sq * least_sq < bound * bound * square)
    return near != 0


def rank(cos, sin, ranks):
    """Write numbers in [-2, 2] that rise with the angle, half a turn being two."""
    for j in range(N):
        part = sin[j] / (abs(cos[j]) + abs(sin[j]))
        ranks[j] = part if cos[j] >= 0.0 else copysign(2.0, sin[j]) - part


def angle(r):
    """Return the angle of a rank, which may be beyond a turn."""
    turns = floor((r + 2.0) / 4.0)
    r -= 4.0 * turns
    sine = r if abs(r) <= 1.0 else copysign(2.0, r) - r
    return atan2(sine, 1.0 - abs(r)) + 2.0 * pi * turns


def joint_range(cos, sin, ranks):
    """Return least and greatest angle over the path, unwrapped, the way back of a closed seam included."""
    rank(cos, sin, ranks)
    low, high = least(ranks), greatest(ranks)
    if high - low > 2.0:  # a path that never spans half a turn has no cut to unwrap
        turns, low, high = 0.0, ranks[0], ranks[0]
        for j in range(N if CLOSED else N - 1):
            following = ranks[j + 1] if j + 1 < N else ranks[0]
            step = following - ranks[j]
            turns += 4.0 * ((step < -2.0) - 1.0 * (step > 2.0))
            low, high = min(low, following + turns), max(high, following + turns)
    return angle(low), angle(high)


def margin(low, high, lower, upper, need):
    """Return how far a range stays inside joint limits, shifted by whole turns if it must."""
    as_is = min(upper - high, low - lower)
    if as_is >= need:
        return as_is
    turns = 2.0 * pi * np.round((upper + lower - low - high) / (4.0 * pi))
    return min(upper - high - turns, low + turns - lower)


def missed_joints(facts, k, cos_sin, ranks):
    """Return by how many half turns station k's best wrist misses its joint limits."""
    need, n = facts.levels[0], facts.joints.shape[2]
    keeps, flipped = inf, inf
    for i in range(n):
        lower, upper, offset = facts.joints[k, 0, i], facts.joints[k, 1, i], facts.joints[k, 2, i]
        low, high = joint_range(cos_sin[i * N : (i + 1) * N], cos_sin[(n + i) * N : (n + i + 1) * N], ranks)
        low, high = low - offset, high - offset
        keeps = min(keeps, margin(low, high, lower, upper, need))
        if i == 3 or i == 5:
            low, high = low + pi, high + pi
        elif i == 4:
            low, high = -high - 2.0 * offset, -low - 2.0 * offset
        flipped = min(flipped, margin(low, high, lower, upper, need))
    best = max(keeps if facts.wrists[0] else -inf, flipped if facts.wrists[1] else -inf)
    return max(0.0, need - best) / pi


def middles(ends, out, bodies):
    """Write the middles of bodies' axes."""
    for i in range(bodies):
        here, mine = ends[6 * N * i : 6 * N * (i + 1)], out[3 * N * i : 3 * N * (i + 1)]
        for j in range(3 * N):
            mine[j] = 0.5 * (here[j] + here[j + 3 * N])


def lowest_gap(facts, scratch, meeting, b, c):
    """Return the least clearance of two owners' bodies on branches b, c, or the level if none is below it [m]."""
    low, (k, other) = facts.levels[2], facts.owners[meeting]
    bodies, numbers, halves, spare = facts.bodies, facts.numbers, facts.halves, scratch.spare
    middles_a, middles_b = scratch.middles[k, b], scratch.middles[other, c]
    for p in range(facts.first[meeting], facts.first[meeting + 1]):
        i, j = bodies[p, 0], bodies[p, 1]
        reach = numbers[p, 2] + facts.levels[2]
        if any_near(middles_a, i, middles_b, j, halves[p] + reach):
            mine, theirs = scratch.ends[k, b, 6 * N * i :], scratch.ends[other, c, 6 * N * j :]
            if axes_near(mine, theirs, reach):
                gap(1, mine, theirs, numbers[p], spare)
                low = min(low, least(spare))
    return low


def lowest_height(facts, ends, owner):
    """Return the least clearance of an owner's bodies from the floor [m]."""
    low = inf
    for f in range(facts.floors.shape[0]):
        if facts.floors[f, 0] == owner:
            body = int(facts.floors[f, 1])
            low = min(low, lowest_end(ends[6 * N * body : 6 * N * (body + 1)]) - facts.floors[f, 2])
    return low


def missed_gap(facts, gap_m):
    """Return by how much a clearance is missed."""
    return max(0.0, facts.levels[2] - gap_m) / GAP_SCALE_M


def gripped(facts, scratch, x, k, b):
    """Grip with station k on branch b, note what it misses, and tell whether to look any further."""
    missed, w, spare, level = scratch.missed[k, b], scratch.w[k, b], scratch.spare, facts.levels[1]
    grip(k, x, facts.points, facts.signs[b], scratch.cos_sin, w, spare)
    missed[0] = max(0.0, -least(spare))
    missed[1] = missed_joints(facts, k, scratch.cos_sin, spare) if missed[0] == 0.0 else 0.0
    missed[2] = max(0.0, level - least(w)) / (level if level > 0.0 else 1.0)
    missed[3] = 0.0
    return missed[0] == 0.0 and missed[1] == 0.0 and missed[2] < NEAR


def missed_alone(facts, scratch, k, b):
    """Return the clearance missed by robot k on branch b by itself, from workpiece and floor."""
    low = lowest_height(facts, scratch.ends[k, b], k)
    for meeting in range(facts.owners.shape[0]):
        if facts.owners[meeting, 0] == k and facts.owners[meeting, 1] == facts.joints.shape[0]:
            low = min(low, lowest_gap(facts, scratch, meeting, b, 0))
    return missed_gap(facts, low)


def placed_work(facts, scratch, x):
    """Put the workpiece's bodies where they are."""
    stations = facts.joints.shape[0]
    work(1, x, facts.points, scratch.ends[stations, 0])
    middles(scratch.ends[stations, 0], scratch.middles[stations, 0], facts.counts[stations])


def placed_limbs(facts, scratch, x, k, b):
    """Go on from joints and base to velocity ellipsoid and bodies."""
    limbs(k, x, scratch.cos_sin, facts.points, scratch.gram[k, b], scratch.ends[k, b])
    middles(scratch.ends[k, b], scratch.middles[k, b], facts.counts[k])


def sides(facts, scratch, x):
    """Look at every station on every branch; return the clearance the workpiece misses from the floor."""
    stations, have_work, complete = facts.joints.shape[0], False, True
    for k in range(stations):
        any_seen = False
        for b in range(facts.signs.shape[0]):
            scratch.seen[k, b] = gripped(facts, scratch, x, k, b)
            if scratch.seen[k, b]:
                any_seen = True
                if not have_work:
                    placed_work(facts, scratch, x)
                    have_work = True
                placed_limbs(facts, scratch, x, k, b)
                scratch.missed[k, b, 3] = missed_alone(facts, scratch, k, b)
        complete = complete and any_seen
    return missed_gap(facts, lowest_height(facts, scratch.ends[stations, 0], stations)) if complete else 0.0


def missed_together(facts, scratch, choice):
    """Return the clearance missed between robots on chosen branches, looking only where both alone are feasible."""
    worst, missed, known = 0.0, scratch.missed, scratch.known
    for meeting in range(facts.owners.shape[0]):
        k, other = facts.owners[meeting]
        if other < facts.joints.shape[0]:
            b, c = choice[k], choice[other]
            if isnan(known[meeting, b, c]):
                known[meeting, b, c] = 0.0
                if missed[k, b].sum() == 0.0 and missed[other, c].sum() == 0.0:
                    known[meeting, b, c] = missed_gap(facts, lowest_gap(facts, scratch, meeting, b, c))
            worst = max(worst, known[meeting, b, c])
    return worst


def seam_mean(values):
    """Return the mean over the seam."""
    return values.sum() / N


def seam_minimum(values):
    """Return the least value over the seam; not a number where one is none."""
    return least(values) if isfinite(values.sum()) else nan


def seam_soft_minimum(values):
    """Return the power mean over the seam with exponent -EXPONENT."""
    low, total = seam_minimum(values), 0.0
    if not low > 0.0:
        return low
    for j in range(N):
        total += (low / values[j]) ** EXPONENT
    return low * (total / N) ** (-1.0 / EXPONENT)


def seam_value(scratch, choice):
    """Return the objective over the seam on chosen branches, minus infinity where it is not a number."""
    for k in range(choice.shape[0]):
        if not scratch.seen[k, choice[k]]:
            return -inf
        scratch.w_chosen[k * N : (k + 1) * N] = scratch.w[k, choice[k]]
        scratch.gram_chosen[k * N : (k + 1) * N] = scratch.gram[k, choice[k]]
    value(1, scratch.w_chosen, scratch.gram_chosen, scratch.spare)
    found = over_seam(scratch.spare)
    return found if isfinite(found) else -inf


def missed_by(facts, scratch, choice, work_missed):
    """Write what chosen branches miss, constraint by constraint, and return the sum."""
    scratch.total[:3] = 0.0
    scratch.total[3] = max(work_missed, missed_together(facts, scratch, choice))
    for k in range(choice.shape[0]):
        for c in range(4):
            scratch.total[c] = max(scratch.total[c], scratch.missed[k, choice[k], c])
    return scratch.total.sum()


def judge(X, facts, scratch, objective, violation, mode):
    """Judge candidates X (m, d): write objective (m,), violation (m, 4) and best mode (m,)."""
    branches, choice = facts.signs.shape[0], scratch.choice
    for i in range(X.shape[0]):
        work_missed = sides(facts, scratch, X[i])
        scratch.known[:] = nan
        best = inf
        modes = branches ** choice.shape[0]
        first = max(0, facts.only)
        for m in range(first, modes if facts.only < 0 else first + 1):
            rest = m
            for k in range(choice.shape[0] - 1, -1, -1):
                choice[k] = rest % branches
                rest //= branches
            total, found = missed_by(facts, scratch, choice, work_missed), seam_value(scratch, choice)
            if m == first or total < best or (total == best and found > objective[i]):
                best, objective[i], mode[i] = total, found, m
                violation[i] = scratch.total
