# SPDX-License-Identifier: BSD-3-Clause
"""Errors against the truth, computed here so that the page stands on its own: absolute trajectory error after one rigid
alignment, and plane angle and distance. The judge of record is `vip_slam_eval evaluate`, which also asks how much of a
plane's area lies on a true one; here its middle has to."""
import numpy as np


def rotation_matrices(q):
    """Rows x, y, z, w to an array of 3x3 matrices."""
    x, y, z, w = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
                     np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
                     np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], 1)


def interpolate_poses(truth, times, max_gap=0.1):
    """Truth at `times` (mask of those it covers, positions, unit quaternions)."""
    after = np.clip(np.searchsorted(truth[:, 0], times, side='right'), 1, len(truth) - 1)
    before = after - 1
    t0, t1 = truth[before, 0], truth[after, 0]
    ok = (times >= truth[0, 0]) & (times <= truth[-1, 0]) & (t1 - t0 <= max_gap)
    s = np.clip((times - t0) / np.maximum(t1 - t0, 1e-12), 0, 1)[:, None]
    p = truth[before, 1:4] * (1 - s) + truth[after, 1:4] * s
    a, b = truth[before, 4:8], truth[after, 4:8].copy()
    b[np.sum(a * b, axis=1) < 0] *= -1
    # Neighbours are milliseconds apart: the normalised blend equals slerp to 1e-6 rad.
    q = a * (1 - s) + b * s
    return ok, p, q / np.linalg.norm(q, axis=1, keepdims=True)


def nearest_rotation(M):
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt


def rigid_alignment(source, target):
    """4x4 T with target ~ T source, least squares, no scale."""
    mean_s, mean_t = source.mean(0), target.mean(0)
    T = np.eye(4)
    T[:3, :3] = nearest_rotation((target - mean_t).T @ (source - mean_s))
    T[:3, 3] = mean_t - T[:3, :3] @ mean_s
    return T


def rotation_for_orientations(T, position_rmse, p_est, p_true, R_est, R_true):
    """The rotation between the two worlds by which orientations are compared, and how it is found. Positions leave the
    turn about a straight path to their own errors: rmse over the second largest spread, as an angle. There yaw alone is
    aligned, or, where the worlds are not level with each other (no IMU), the orientations themselves."""
    straight, level = 10.0, np.cos(np.radians(5.0))
    spread = np.sqrt(np.linalg.svd(np.cov(p_true.T, bias=True), compute_uv=False)[1])
    if spread > straight * position_rmse:
        return T[:3, :3], 'positions'
    by_orientations = nearest_rotation(np.einsum('nij,nkj->ik', R_true, R_est))
    if by_orientations[2, 2] < level:
        return by_orientations, 'orientations'
    M = (p_true - p_true.mean(0)).T @ (p_est - p_est.mean(0))
    yaw = np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), 'yaw'


def trajectory_error(estimate, truth, time_offset=0.0):
    """`time_offset`: what the stamps of images lack of the truth's clock, s (time_offset of the sensor file)."""
    if len(estimate) < 3 or len(truth) < 2:
        return None
    ok, p_true, q_true = interpolate_poses(truth, estimate[:, 0] + time_offset)
    if ok.sum() < 3:
        return None
    estimate, p_true, q_true = estimate[ok], p_true[ok], q_true[ok]
    T = rigid_alignment(estimate[:, 1:4], p_true)
    position = np.linalg.norm(estimate[:, 1:4] @ T[:3, :3].T + T[:3, 3] - p_true, axis=1)
    ate = float(np.sqrt(np.mean(position ** 2)))
    R_est, R_true = rotation_matrices(estimate[:, 4:8]), rotation_matrices(q_true)
    R_truth_map, aligned_by = rotation_for_orientations(T, ate, estimate[:, 1:4], p_true, R_est, R_true)
    trace = np.einsum('nij,nij->n', R_truth_map @ R_est, R_true)
    rotation = np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1)))
    return {'t': estimate[:, 0], 'position': position, 'rotation': rotation, 'T_truth_map': T,
            'rotation_aligned_by': aligned_by, 'ate': ate, 'median': float(np.median(position)),
            'max': float(position.max()), 'rotation_rmse': float(np.sqrt(np.mean(rotation ** 2))),
            'count': int(len(position))}


def outer_points(plane):
    return np.array([p for polygon in plane['polygons'] for p in polygon['outer']]).reshape(-1, 3)


def contains(plane, point):
    """Is the point's projection inside one of the plane's outlines (holes left aside)?"""
    n = np.array(plane['normal'])
    u = np.cross(n, [0, 0, 1] if abs(n[2]) < 0.9 else [1, 0, 0])
    u /= np.linalg.norm(u)
    v = np.cross(n, u)
    x, y = point @ u, point @ v
    for polygon in plane['polygons']:
        ring = np.array(polygon['outer'])
        a, b = ring @ u, ring @ v
        a2, b2 = np.roll(a, -1), np.roll(b, -1)
        crosses = (b > y) != (b2 > y)
        with np.errstate(divide='ignore', invalid='ignore'):
            if np.sum(crosses & (x < a + (y - b) / (b2 - b) * (a2 - a))) % 2:
                return True
    return False


def worth_finding(plane):
    """Only planes of 1 m2 and more, in view for 2 s and more, count as missed; slanted ones are left alone by design."""
    def at_least(value, limit):
        return value is None or value >= limit
    area = plane['seen_area'] if plane.get('seen_area') is not None else plane['area']
    return plane.get('kind') != 'general' and at_least(area, 1.0) and at_least(plane.get('seen_seconds'), 2.0)


def plane_errors(found, true, T_truth_map):
    """Each found plane against the true plane of like direction and place: [{id, truth, angle (deg), distance (m)}]."""
    T = np.eye(4) if T_truth_map is None else T_truth_map
    rows = []
    for plane in found:
        points = outer_points(plane)
        centre = points.mean(0) if len(points) else -plane['distance'] * np.array(plane['normal'])
        n, centre = T[:3, :3] @ np.array(plane['normal']), T[:3, :3] @ centre + T[:3, 3]
        best = None
        for other in true:
            m = np.array(other['normal'])
            angle = float(np.degrees(np.arccos(np.clip(n @ m, -1.0, 1.0))))  # both look to the open side
            distance = float(abs(m @ centre + other['distance']))
            if angle > 10 or distance > 0.10 or (other['polygons'] and not contains(other, centre)):
                continue
            if best is None or distance < best['distance']:
                best = {'truth': other['id'], 'angle': angle, 'distance': distance}
        rows.append(dict({'id': plane['id']}, **(best or {'truth': None})))
    matched = [row['truth'] for row in rows if row['truth'] is not None]
    expected = {plane['id'] for plane in true if worth_finding(plane)}
    return {'rows': rows, 'true_count': len(expected), 'matched': len(expected & set(matched)),
            'duplicates': len(matched) - len(set(matched)), 'aligned': T_truth_map is not None}
