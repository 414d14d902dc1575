# SPDX-License-Identifier: BSD-3-Clause
"""Judges a run through an L-shaped corridor by the building: its two legs are at a right angle.

The heading of the walls in each image comes from its depth alone; the trajectory turns it into its own world, where it
should be the same in both legs, up to a right angle.
"""
import os

import cv2
import numpy as np

from real.trajectories import interpolated, read_tum, rotations

FOCAL_X, FOCAL_Y, CENTRE_X, CENTRE_Y = 537.6, 539.03, 316.15, 245.52
RATE = 10.0  # images per second
UP = np.array([-0.0044, -0.9993, -0.0364])  # in the folder's world, as imu_from_rgbd_folder finds it in the depth
LEGS = (0.0, 6.0), (12.0, 19.0)  # s after the first image, before and behind the corner
STEP = 8  # pixels (of every second one) from a point to the neighbours that give its normal


def surface_normals(depth):
    """Unit normals and distances of the points that lie on a smooth surface, in the camera's frame."""
    v, u = np.mgrid[0:depth.shape[0]:2, 0:depth.shape[1]:2]
    z = depth[::2, ::2]
    points = np.stack([(u - CENTRE_X) / FOCAL_X * z, (v - CENTRE_Y) / FOCAL_Y * z, z], -1)
    seen = (z > 0.4) & (z < 4.5)
    inner = slice(STEP, -STEP)
    middle, left, right = points[inner, inner], points[inner, :-2 * STEP], points[inner, 2 * STEP:]
    above, below = points[:-2 * STEP, inner], points[2 * STEP:, inner]
    smooth = (seen[inner, inner] & seen[inner, :-2 * STEP] & seen[inner, 2 * STEP:] & seen[:-2 * STEP, inner]
              & seen[2 * STEP:, inner])
    # At an edge in depth the point does not lie between its neighbours.
    smooth &= np.linalg.norm((left + right) / 2 - middle, axis=-1) < 0.02 * middle[..., 2]
    normals = np.cross(right - left, below - above)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1), 1e-9)[..., None]
    return normals[smooth], middle[..., 2][smooth]


def wall_direction(depth, up):
    """Horizontal direction of the walls modulo 90 degrees, as a unit vector in the camera's frame; None: unclear."""
    normals, distances = surface_normals(depth)
    vertical = abs(normals @ up) < 0.12
    normals, weights = normals[vertical], 1 / distances[vertical] ** 2
    if len(normals) < 5000:
        return None
    forward = np.array([0, 0, 1.0]) - up[2] * up
    forward /= np.linalg.norm(forward)
    side = np.cross(up, forward)
    heading = np.arctan2(normals @ side, normals @ forward)

    def off(angle):
        return (heading - angle + np.pi / 4) % (np.pi / 2) - np.pi / 4

    grid = np.radians(np.arange(0, 90, 0.5))
    best = grid[np.argmax([(np.exp(-(off(angle) / np.radians(2)) ** 2) * weights).sum() for angle in grid])]
    for _ in range(10):
        near = np.exp(-(off(best) / np.radians(1.5)) ** 2) * weights
        best += (near * off(best)).sum() / near.sum()
    if weights[abs(off(best)) < np.radians(3)].sum() < 0.5 * weights.sum():
        return None
    return np.cos(best) * forward + np.sin(best) * side


def walls(folder):
    """Of each image in the legs: seconds after the first, direction of the walls and up, in the camera's frame."""
    out = []
    for i in range(int(LEGS[1][1] * RATE) + 1):
        name = os.path.join(folder, 'frame-%06d' % i)
        if not os.path.exists(name + '.depth.png') or LEGS[0][1] <= i / RATE <= LEGS[1][0]:
            continue
        depth = cv2.imread(name + '.depth.png', cv2.IMREAD_UNCHANGED) / 1000.0
        up = np.loadtxt(name + '.pose.txt')[:3, :3].T @ UP
        direction = wall_direction(depth, up)
        if direction is not None:
            out.append((i / RATE, direction, up))
    return out


def corner(trajectory, sensor, first_stamp, seen):
    """Degrees by which the two legs are off a right angle; None when the trajectory does not cover both.

    `trajectory`: TUM file; `sensor`: its sensor file's content; `first_stamp`: of the first image; `seen`: of walls().
    """
    poses = read_tum(trajectory)
    if len(poses) < 2:
        return None
    times = np.array([w[0] for w in seen])
    at, known = interpolated(poses, times + first_stamp, widest=2.5 / RATE)
    if known.sum() < 3:
        return None
    turn = rotations(at) @ np.array(sensor['T_imu_cam'], float)[:3, :3]
    direction = np.einsum('nij,nj->ni', turn, np.array([w[1] for w in seen]))
    up = np.einsum('nij,nj->ni', turn, np.array([w[2] for w in seen]))[known].mean(0)  # the world may not be level
    up /= np.linalg.norm(up)
    x = np.cross(up, [0, 1, 0] if abs(up[1]) < 0.9 else [1, 0, 0])
    x /= np.linalg.norm(x)
    heading = np.degrees(np.arctan2(direction @ np.cross(up, x), direction @ x))
    legs = [known & (times >= begin) & (times < end) for begin, end in LEGS]
    if min(leg.sum() for leg in legs) < 10:
        return None
    zero = np.degrees(np.angle(np.exp(4j * np.radians(heading[legs[0]])).mean())) / 4
    first, second = (np.median((heading[leg] - zero + 45) % 90 - 45) for leg in legs)
    return float(second - first)
