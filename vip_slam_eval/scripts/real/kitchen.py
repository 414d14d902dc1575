# SPDX-License-Identifier: BSD-3-Clause
"""Judges a run on 7-Scenes' red kitchen by its own images, without truth.

Depth: points of one image, moved by the run, against the surface that another image sees there. Tracks: corners that
were followed from one image to another, against the pixels where the run, the depth and the calibration expect them.
Both tell how well the poses agree with what was seen over that time; neither knows of a motion's common scale.
"""
import os

import cv2
import numpy as np

from real.trajectories import interpolated, matrices, read_tum

RATE = 30.0  # images per second
EDGE = 6     # px, half the window within which a surface has to be smooth


def robust_sigma(values):
    return 1.4826 * np.median(abs(values))


class Kitchen:
    """The images, read once, and the calibration that the folder's bags have."""

    def __init__(self, folder, sensor):
        self.count = sum(name.endswith('.depth.png') for name in os.listdir(folder))
        self.folder, self.clouds = folder, {}
        color, depth = sensor['camera'], sensor['depth_camera']
        self.color = np.array([color[k] for k in ('fx', 'fy', 'cx', 'cy')], float)
        self.depth = np.array([depth[k] for k in ('fx', 'fy', 'cx', 'cy')], float)
        self.T_color_depth = np.array(sensor['T_color_depth'], float)
        self.T_body_color = np.array(sensor['T_imu_cam'], float)
        self.gray = [cv2.imread(self.name(i) + '.color.jpg', cv2.IMREAD_GRAYSCALE) for i in range(self.count)]

    def name(self, i):
        return os.path.join(self.folder, 'frame-%06d' % i)

    def cloud(self, i):
        """Points (h, w, 3) in the depth camera, unit normals, and where both are sound."""
        if i not in self.clouds:
            z = cv2.imread(self.name(i) + '.depth.png', cv2.IMREAD_UNCHANGED).astype(float)
            z[z == 65535] = 0
            z /= 1000
            v, u = np.mgrid[0:z.shape[0], 0:z.shape[1]]
            fx, fy, cx, cy = self.depth
            points = np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], -1)
            sound = cv2.erode(((z > 0.4) & (z < 4)).astype(np.uint8), np.ones((2 * EDGE + 1,) * 2)) > 0
            along = np.zeros_like(points), np.zeros_like(points)
            inner = slice(EDGE, -EDGE)
            along[0][:, inner] = points[:, 2 * EDGE:] - points[:, :-2 * EDGE]
            along[1][inner] = points[2 * EDGE:] - points[:-2 * EDGE]
            normals = np.cross(*along)
            normals /= np.maximum(np.linalg.norm(normals, axis=-1), 1e-9)[..., None]
            for axis in (0, 1):  # at an edge a point does not lie between its neighbours
                between = (np.roll(points, EDGE, 1 - axis) + np.roll(points, -EDGE, 1 - axis)) / 2 - points
                sound &= np.linalg.norm(between, axis=-1) < 0.02 * np.maximum(z, 0.1)
            facing = abs((normals * points).sum(-1)) / np.maximum(np.linalg.norm(points, axis=-1), 1e-9)
            self.clouds[i] = points, normals, sound & (facing > 0.3)
        return self.clouds[i]

    def cameras(self, trajectory, first_stamp):
        """World from colour camera at each image, and where the trajectory has a pose."""
        poses = read_tum(trajectory)
        if len(poses) < 2:
            return None, np.zeros(self.count, bool)
        at, known = interpolated(poses, first_stamp + np.arange(self.count) / RATE)
        return matrices(at) @ self.T_body_color, known


def depth_misfit(kitchen, trajectory, first_stamp, seconds=1.0):
    """Median distance of points to the other image's surface, mean over pairs of images, mm; None: no pairs."""
    cameras, known = kitchen.cameras(trajectory, first_stamp)
    gap, misfits = int(round(seconds * RATE)), []
    fx, fy, cx, cy = kitchen.depth
    for i in range(0, kitchen.count - gap, 21):
        if not (known[i] and known[i + gap]):
            continue
        points, normals, sound = kitchen.cloud(i)
        other, other_normals, other_sound = kitchen.cloud(i + gap)
        there = np.linalg.inv(cameras[i + gap] @ kitchen.T_color_depth) @ cameras[i] @ kitchen.T_color_depth
        pick = np.zeros_like(sound)
        pick[::8, ::8] = sound[::8, ::8]
        p = points[pick] @ there[:3, :3].T + there[:3, 3]
        n = normals[pick] @ there[:3, :3].T
        z = np.maximum(p[:, 2], 0.1)
        u, v = np.round(p[:, 0] / z * fx + cx).astype(int), np.round(p[:, 1] / z * fy + cy).astype(int)
        ok = (p[:, 2] > 0.4) & (u >= 0) & (u < sound.shape[1]) & (v >= 0) & (v < sound.shape[0])
        p, n, u, v = p[ok], n[ok], u[ok], v[ok]
        off = ((p - other[v, u]) * other_normals[v, u]).sum(-1)
        same = other_sound[v, u] & ((n * other_normals[v, u]).sum(-1) > 0.8) & (abs(off) < 0.15)
        if same.sum() >= 200:
            misfits.append(np.median(abs(off[same])))
    return 1e3 * float(np.mean(misfits)) if misfits else None


def corners_with_depth(kitchen, i):
    """Textured pixels of image i on smooth surfaces: pixels (n, 2) and points (n, 3) in the colour camera."""
    points, _, sound = kitchen.cloud(i)
    pick = np.zeros_like(sound)
    pick[8:-8:6, 8:-8:6] = sound[8:-8:6, 8:-8:6]
    moved = points[pick] @ kitchen.T_color_depth[:3, :3].T + kitchen.T_color_depth[:3, 3]
    pixels = projected(kitchen, moved)
    h, w = kitchen.gray[i].shape
    inside = ((pixels > 20) & (pixels < [w - 20, h - 20])).all(1)
    pixels, moved = pixels[inside], moved[inside]
    texture = cv2.cornerMinEigenVal(kitchen.gray[i], 7)[tuple(np.round(pixels).astype(int).T[::-1])]
    good = (texture > np.quantile(texture, 0.8)) & (texture > 2e-4) if len(texture) else np.zeros(0, bool)
    return pixels[good], moved[good]


def projected(kitchen, points):
    fx, fy, cx, cy = kitchen.color
    z = np.maximum(points[:, 2], 0.1)
    return np.stack([fx * points[:, 0] / z + cx, fy * points[:, 1] / z + cy], -1)


def followed(a, b, pixels, start):
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        a, b, pixels.astype(np.float32).reshape(-1, 1, 2), start.astype(np.float32).reshape(-1, 1, 2).copy(),
        winSize=(17, 17), maxLevel=2, flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
    return found.reshape(-1, 2), status.ravel() == 1


def track_misfit(kitchen, trajectory, first_stamp, gap=10):
    """Robust sigma of tracked minus expected pixels over `gap` images, median over pairs, px; None: no pairs."""
    cameras, known = kitchen.cameras(trajectory, first_stamp)
    misfits = []
    for i in range(0, kitchen.count - gap, 6):
        if not (known[i] and known[i + gap]):
            continue
        pixels, points = corners_with_depth(kitchen, i)
        if len(pixels) < 60:
            continue
        there = np.linalg.inv(cameras[i + gap]) @ cameras[i]
        expected = projected(kitchen, points @ there[:3, :3].T + there[:3, 3])
        tracked, ok = followed(kitchen.gray[i], kitchen.gray[i + gap], pixels, expected)
        back, ok_back = followed(kitchen.gray[i + gap], kitchen.gray[i], tracked, pixels)
        off = tracked - expected
        ok &= ok_back & (np.linalg.norm(back - pixels, axis=1) < 0.5) & (np.linalg.norm(off, axis=1) < 12)
        if ok.sum() >= 60:
            misfits.append(robust_sigma(off[ok].ravel()))
    return float(np.median(misfits)) if misfits else None
