# SPDX-License-Identifier: BSD-3-Clause
"""Trajectories in TUM files, and how far one lies from another.

Poses are rows (t, x, y, z, qx, qy, qz, qw) of T_world_body; rotations are arrays of matrices.
"""
import numpy as np


def read_tum(path):
    """Rows of the file, shape (n, 8); n = 0 when it has none."""
    with open(path, encoding='utf-8') as file:
        rows = [line.split() for line in file if line.strip() and not line.startswith('#')]
    return np.array(rows, float).reshape(-1, 8)


def rotations(poses):
    """Rotation matrices of the poses, shape (n, 3, 3)."""
    x, y, z, w = (poses[:, 4:8] / np.linalg.norm(poses[:, 4:8], axis=1)[:, None]).T
    return np.stack([
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
        np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
        np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def angles(matrices):
    """Angle of each rotation, radians."""
    return np.arccos(np.clip((np.trace(matrices, axis1=1, axis2=2) - 1) / 2, -1, 1))


def interpolated(poses, times, widest=0.15):
    """The poses at `times`, and which of them are known: within the trajectory and no hole wider than `widest` s."""
    after = np.clip(np.searchsorted(poses[:, 0], times), 1, len(poses) - 1)
    a, b = poses[after - 1], poses[after].copy()
    b[:, 4:8] *= np.where((a[:, 4:8] * b[:, 4:8]).sum(1) < 0, -1, 1)[:, None]
    share = ((times - a[:, 0]) / (b[:, 0] - a[:, 0]))[:, None]
    out = (1 - share) * a + share * b
    out[:, 0] = times
    out[:, 4:8] /= np.linalg.norm(out[:, 4:8], axis=1)[:, None]
    known = (share[:, 0] >= -1e-6) & (share[:, 0] <= 1 + 1e-6) & (b[:, 0] - a[:, 0] <= widest)
    return out, known


def matrices(poses):
    """Poses as 4x4 matrices."""
    out = np.tile(np.eye(4), (len(poses), 1, 1))
    out[:, :3, :3] = rotations(poses)
    out[:, :3, 3] = poses[:, 1:4]
    return out


def alignment(source, target, with_scale):
    """R, t, s that bring the points `source` nearest to `target` (Umeyama 1991)."""
    source_mean, target_mean = source.mean(0), target.mean(0)
    u, singular, vt = np.linalg.svd((target - target_mean).T @ (source - source_mean))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ np.diag(sign) @ vt
    spread = ((source - source_mean) ** 2).sum()
    scale = (singular * sign).sum() / spread if with_scale and spread > 0 else 1.0
    return rotation, target_mean - scale * rotation @ source_mean, scale


def errors(estimate, truth):
    """ATE (m), ATE with free scale (m), that scale, RMSE of the rotation (degrees); None when there is too little.

    The rotation's error is what the best constant rotation of the world leaves.
    """
    reference, known = interpolated(truth, estimate[:, 0]) if len(estimate) and len(truth) > 1 else (None, np.zeros(0))
    if known.sum() < 3:
        return None
    estimate, reference = estimate[known.astype(bool)], reference[known.astype(bool)]
    result = []
    for with_scale in (False, True):
        rotation, shift, scale = alignment(estimate[:, 1:4], reference[:, 1:4], with_scale)
        left = scale * estimate[:, 1:4] @ rotation.T + shift - reference[:, 1:4]
        result.append(float(np.sqrt((left ** 2).sum(1).mean())))
    estimated, true = rotations(estimate), rotations(reference)
    u, _, vt = np.linalg.svd(np.einsum('nij,nkj->ik', true, estimated))
    world = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    off = angles(np.einsum('nji,jk,nkl->nil', true, world, estimated))
    return result[0], result[1], scale, float(np.degrees(np.sqrt((off ** 2).mean())))
