# SPDX-License-Identifier: BSD-3-Clause
"""Images as a lens would have made them of those of a camera without one."""
import numpy as np

RADIAL = (-0.25, 0.06)  # k1, k2 of plumb_bob: 17 pixels in the corners of 320 x 240 at a focal length of 240


class Lens:
    """For each pixel behind the lens, where it lies in the image without."""

    def __init__(self, camera):
        v, u = np.mgrid[0:camera['height'], 0:camera['width']].astype(float)
        focal, centre = (camera['fx'], camera['fy']), (camera['cx'], camera['cy'])
        seen = np.stack([(u - centre[0]) / focal[0], (v - centre[1]) / focal[1]])
        straight = seen.copy()
        for _ in range(50):
            squared = (straight ** 2).sum(0)
            straight = seen / (1 + squared * (RADIAL[0] + squared * RADIAL[1]))
        self.u, self.v = straight[0] * focal[0] + centre[0], straight[1] * focal[1] + centre[1]
        self.inside = (self.u >= 0) & (self.v >= 0) & (self.u < camera['width'] - 1) & (self.v < camera['height'] - 1)

    def depth(self, image):
        u, v = np.rint(self.u).astype(int), np.rint(self.v).astype(int)
        return np.where(self.inside, image[np.clip(v, 0, image.shape[0] - 1), np.clip(u, 0, image.shape[1] - 1)],
                        0).astype(np.uint16)

    def colour(self, image):
        u, v = np.clip(self.u, 0, image.shape[1] - 1.001), np.clip(self.v, 0, image.shape[0] - 1.001)
        left, top = u.astype(int), v.astype(int)
        right, down = (u - left)[..., None], (v - top)[..., None]
        image = image.astype(float)
        upper = image[top, left] * (1 - right) + image[top, left + 1] * right
        lower = image[top + 1, left] * (1 - right) + image[top + 1, left + 1] * right
        return np.where(self.inside[..., None], upper * (1 - down) + lower * down + 0.5, 0).astype(np.uint8)
