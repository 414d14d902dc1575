# SPDX-License-Identifier: BSD-3-Clause
"""How far poses are off, and for how long by more than they say."""
import numpy as np

from real.trajectories import alignment, interpolated, read_tum, rotations

ANCHOR = 0.5  # s after the first pose, over which position and heading are fixed


def read_covariances(path):
    """Stamps, and the 3x3 covariances of the positions."""
    rows = np.loadtxt(path, delimiter=',', skiprows=1, ndmin=2)
    upper = rows[:, [1, 2, 3, 2, 7, 8, 3, 8, 12]]
    return rows[:, 0], upper.reshape(-1, 3, 3)


def heading(rotation):
    """Angle about the vertical that comes nearest to the rotation."""
    return np.arctan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])


def about_vertical(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def anchored(estimate, truth):
    """Errors of the positions at known times, m, with position and heading fixed at the start; and which are known."""
    reference, known = interpolated(truth, estimate[:, 0])
    known = known.astype(bool)
    estimate, reference = estimate[known], reference[known]
    if len(estimate) < 3:
        return np.zeros((0, 3)), known
    first = estimate[:, 0] < estimate[0, 0] + ANCHOR
    apart = np.einsum('nij,nkj->nik', rotations(reference[first]), rotations(estimate[first]))
    turn = about_vertical(np.angle(np.mean([np.exp(1j * heading(r)) for r in apart])))
    moved = estimate[:, 1:4] @ turn.T
    moved += (reference[first, 1:4] - moved[first]).mean(0)
    return moved - reference[:, 1:4], known


def longest_beyond(errors, sigmas, times, gate=3.0):
    """For how long, at most, errors are larger than so many sigmas, s: from the first such pose to the last."""
    longest, begin = 0.0, None
    for error, sigma, t in zip(errors, sigmas, times):
        if error <= gate * sigma:
            begin = None
            continue
        begin = t if begin is None else begin
        longest = max(longest, t - begin)
    return longest


def consistency(odometry, covariances, truth, restored):
    """Longest time beyond three sigmas, s, and the largest error with its sigma, m; None without poses."""
    estimate = read_tum(odometry)
    if len(estimate) < 3:
        return None
    stamps, matrices = read_covariances(covariances)
    of = np.clip(np.searchsorted(stamps, estimate[:, 0] - 1e-6), 0, len(stamps) - 1)
    sigmas = np.sqrt(np.trace(matrices[of], axis1=1, axis2=2))
    estimate[:, 0] = restored(estimate[:, 0])
    errors, known = anchored(estimate, truth)
    if not len(errors):
        return None
    sizes, sigmas = np.linalg.norm(errors, axis=1), sigmas[known]
    worst = int(np.argmax(sizes))
    return longest_beyond(sizes, sigmas, estimate[known, 0]), float(sizes[worst]), float(sigmas[worst])


def accuracy(path, truth, restored):
    """RMSE and largest error of the positions, m, aligned as a whole; None without poses."""
    estimate = read_tum(path)
    if len(estimate):
        estimate[:, 0] = restored(estimate[:, 0])
    reference, known = interpolated(truth, estimate[:, 0]) if len(estimate) else (None, np.zeros(0))
    known = known.astype(bool)
    if known.sum() < 3:
        return None
    estimate, reference = estimate[known], reference[known]
    rotation, shift, _ = alignment(estimate[:, 1:4], reference[:, 1:4], False)
    left = np.linalg.norm(estimate[:, 1:4] @ rotation.T + shift - reference[:, 1:4], axis=1)
    return float(np.sqrt((left ** 2).mean())), float(left.max())
