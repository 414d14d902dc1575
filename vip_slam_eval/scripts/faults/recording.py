# SPDX-License-Identifier: BSD-3-Clause
"""A rendered recording, and what its messages are rewritten with."""
import copy

import numpy as np
import rosbag
import rospy
import yaml

from real.trajectories import read_tum, rotations


class Recording:
    """A bag of the simulator with its sensor file and its truth."""

    def __init__(self, stem):
        self.bag, self.truth_file = stem + '.bag', stem + '_truth.tum'
        with open(stem + '_sensor.yaml', encoding='utf-8') as file:
            self.sensor = yaml.safe_load(file)
        topics = self.sensor['topics']
        self.color, self.depth, self.imu = topics['color'], topics['depth'], topics['imu']
        self.color_info, self.depth_info = topics['color_info'], topics['depth_info']
        self.images, self.infos = (self.color, self.depth), (self.color_info, self.depth_info)
        self.of_camera = self.images + self.infos
        self.streams = self.of_camera + (self.imu,)
        with rosbag.Bag(self.bag) as bag:
            self.begin, self.end = bag.get_start_time(), bag.get_end_time()
        self.middle = 0.5 * (self.begin + self.end)
        self.truth = read_tum(self.truth_file)

    def rewritten(self, target, change):
        """Writes the bag again; `change(topic, message)`: the messages [(topic, message), ...] in place of one."""
        with rosbag.Bag(self.bag) as source, rosbag.Bag(target, 'w') as bag:
            for topic, message, t in source.read_messages():
                changed = [(topic, message)]
                if topic in self.streams:
                    changed = change(topic, message)
                for to, what in changed:
                    bag.write(to, what, t)

    def true_rotations(self, times):
        """R_world_body at these times, from the nearest true poses."""
        nearest = np.clip(np.searchsorted(self.truth[:, 0], times), 0, len(self.truth) - 1)
        return rotations(self.truth[nearest])

    def with_sensor(self, **changes):
        """The sensor file with other values; sections are merged."""
        sensor = copy.deepcopy(self.sensor)
        for key, value in changes.items():
            if isinstance(value, dict):
                sensor[key].update(value)
            else:
                sensor[key] = value
        return sensor


def stamp(message):
    return message.header.stamp.to_sec()


def restamped(message, seconds):
    """The message, stamped so much later."""
    message = copy.copy(message)
    message.header = copy.copy(message.header)
    message.header.stamp = rospy.Time.from_sec(max(0.0, stamp(message) + seconds))
    return message


def pixels(message):
    """An image's pixels; not to be written to."""
    if message.encoding == '16UC1':
        return np.frombuffer(message.data, np.uint16).reshape(message.height, message.width)
    return np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, 3)


def with_pixels(message, values, encoding=None):
    """The message with other pixels, of the same size."""
    message = copy.copy(message)
    values = np.ascontiguousarray(values)
    message.encoding = encoding or message.encoding
    message.step = values.strides[0]
    message.data = values.tobytes()
    return message


def inertial(message):
    """Specific force and rate, as arrays."""
    a, w = message.linear_acceleration, message.angular_velocity
    return np.array([a.x, a.y, a.z]), np.array([w.x, w.y, w.z])


def with_inertial(message, force, rate):
    message = copy.deepcopy(message)
    a, w = message.linear_acceleration, message.angular_velocity
    a.x, a.y, a.z = force
    w.x, w.y, w.z = rate
    return message
