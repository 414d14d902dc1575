# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the running system share."""
import os
import re
import threading
import time

import numpy as np
import rospy
from vip_slam_msgs.msg import TrackingStatus

REPOSITORY = os.path.realpath(os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', '..', '..'))


def wait_for(condition, seconds, what):
    """Waits by the wall clock; the bag's clock may stand still."""
    end = time.time() + seconds
    while time.time() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError('not within %.0f s: %s' % (seconds, what))


def load_tum(path):
    return np.atleast_2d(np.loadtxt(path))


def positions_at(truth, times):
    return np.stack([np.interp(times, truth[:, 0], truth[:, k]) for k in (1, 2, 3)], 1)


def alignment(points, onto):
    """Rotation and translation, the best rigid ones."""
    p0, q0 = onto.mean(0), points.mean(0)
    u, _, vt = np.linalg.svd((points - q0).T @ (onto - p0))
    R = vt.T @ np.diag([1, 1, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return R, p0 - R @ q0


def position_error(truth, estimate):
    """Root mean square after the best rigid alignment, metres."""
    onto, points = positions_at(truth, estimate[:, 0]), estimate[:, 1:4]
    R, t = alignment(points, onto)
    return np.sqrt(((points @ R.T + t - onto) ** 2).sum(1).mean())


class Listener:
    """Keeps all messages of a topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self.lock = threading.Lock()
        self.subscriber = rospy.Subscriber(topic, kind, self.add, queue_size=1000)

    def add(self, message):
        with self.lock:
            self.messages.append(message)

    def all(self):
        with self.lock:
            return list(self.messages)

    def last(self):
        with self.lock:
            return self.messages[-1] if self.messages else None

    def count(self):
        return len(self.messages)

    def wait_for_silence(self, silence, seconds, what):
        """No message for `silence` seconds; what was under way before may still come in."""
        end = time.time() + seconds
        count, since = self.count(), time.time()
        while time.time() - since < silence:
            assert time.time() < end, 'not within %.0f s: %s' % (seconds, what)
            time.sleep(0.05)
            if self.count() != count:
                count, since = self.count(), time.time()

    def wait(self, number, seconds, what):
        """`number` messages more than now."""
        target = self.count() + number
        wait_for(lambda: self.count() >= target, seconds, what)


def tracking(status):
    return status is not None and status.state == TrackingStatus.TRACKING


def documented(kind):
    """(name, type) of each topic or service in the tables of the documents whose header names `kind`."""
    rows = []
    for document in ('README.md', 'docs/ros_api.md'):
        inside = False
        with open(os.path.join(REPOSITORY, document), encoding='utf-8') as file:
            for line in file:
                cells = [cell.strip() for cell in line.strip().strip('|').split('|')]
                if not line.startswith('|'):
                    inside = False
                elif cells[0] == kind:
                    inside = 'type' in cells
                elif inside and '`' in cells[0]:
                    names = re.findall(r'`([^`]+)`', cells[0])
                    types = re.findall(r'[a-z0-9_]+/[A-Za-z0-9]+', cells[1])
                    # One type in the row counts for all its names.
                    rows += [(name, types[min(k, len(types) - 1)]) for k, name in enumerate(names) if types]
    return sorted(set(rows))
