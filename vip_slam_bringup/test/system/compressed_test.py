#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The live system on compressed images, with or without the plugins of image_transport: Debian has none."""
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import numpy as np
import rosbag
import rospy
import rostest
from sensor_msgs.msg import CompressedImage
from vip_slam_msgs.msg import TrackedFrame, TrackingStatus

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, tracking, wait_for  # noqa: E402

COLOR, DEPTH = '/camera/color/image_raw', '/camera/aligned_depth_to_color/image_raw'
SECONDS = 5.0  # of the sequence


def png(pixels):
    """Grey of 16 bit, or red, green and blue of 8."""
    height, width = pixels.shape[:2]
    depth, kind = (16, 0) if pixels.dtype == np.uint16 else (8, 2)
    rows = pixels.astype('>u2' if depth == 16 else np.uint8).reshape(height, -1)
    lines = np.hstack([np.zeros((height, 1), np.uint8), np.ascontiguousarray(rows).view(np.uint8)])

    def chunk(name, data):
        return struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))

    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>2I5B', width, height, depth, kind, 0, 0, 0)) +
            chunk(b'IDAT', zlib.compress(lines.tobytes(), 1)) + chunk(b'IEND', b''))


def compress(image):
    kind, channels = (np.uint16, 1) if image.encoding == '16UC1' else (np.uint8, 3)
    pixels = np.frombuffer(image.data, kind).reshape(image.height, image.width, channels)
    return png(pixels)


class CompressedTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('compressed_test')
        cls.data = rospy.get_param('~data')
        cls.folder = tempfile.mkdtemp()
        cls.bag = os.path.join(cls.folder, 'compressed.bag')
        # Colour as camera drivers and phones send it; depth as phones do, a bare PNG, and as compressedDepth.
        with rosbag.Bag(os.path.join(cls.data, 'smoke.bag')) as bag, rosbag.Bag(cls.bag, 'w') as out:
            begin = bag.get_start_time()
            for topic, message, stamp in bag.read_messages():
                if stamp.to_sec() - begin > SECONDS:
                    break
                if topic not in (COLOR, DEPTH):
                    out.write(topic, message, stamp)
                    continue
                data = compress(message)
                if topic == COLOR:
                    out.write(topic + '/compressed', CompressedImage(message.header, 'rgb8; png compressed', data), stamp)
                else:
                    out.write(topic + '/compressed', CompressedImage(message.header, 'png', data), stamp)
                    out.write(topic + '/compressedDepth', CompressedImage(
                        message.header, '16UC1; compressedDepth png', bytes(12) + data), stamp)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def sensor_with(self, *changes):
        with open(os.path.join(self.data, 'smoke_sensor.yaml')) as file:
            text = file.read()
        for old, new in changes:
            text, count = re.subn(old, new, text)
            self.assertEqual(count, 1, old)
        path = os.path.join(self.folder, 'sensor.yaml')
        with open(path, 'w') as file:
            file.write(text)
        return path

    def parameters(self, text):
        path = os.path.join(self.folder, 'parameters.yaml')
        with open(path, 'w') as file:
            file.write('frontend: {%s}\nplanes: {}\nbackend: {}\n' % text)
        return path

    def follow(self, sensor, parameters):
        """Plays the bag: the images are tracked, all of them with their depth."""
        status, frames = Listener('/vip_slam/tracking_status', TrackingStatus), Listener('/vip_slam/tracked_frame',
                                                                                        TrackedFrame)
        launch = subprocess.Popen(['roslaunch', '--no-summary', 'vip_slam_bringup', 'bag.launch', 'rviz:=false',
                                   'bag:=' + self.bag, 'sensor:=' + sensor, 'params:=' + parameters])
        try:
            wait_for(lambda: tracking(status.last()), 40, 'TRACKING')
            frames.wait(20, 20, 'images')
            wait_for(lambda: sum(f.depth > 0 for f in frames.last().features) > 50, 10, 'features with depth')
        finally:
            launch.terminate()
            launch.wait(30)

    def test_01_topics_of_the_sensor_file(self):
        sensor = self.sensor_with(('color: "%s"' % COLOR, 'color: "%s/compressed"' % COLOR),
                                  ('depth: "%s"' % DEPTH, 'depth: "%s/compressed"' % DEPTH),
                                  ('encoding: rgb8', 'encoding: compressed'),
                                  ('encoding: 16UC1', 'encoding: compressed'))
        self.follow(sensor, self.parameters(''))

    def test_02_transports_by_parameter(self):
        self.follow(os.path.join(self.data, 'smoke_sensor.yaml'),
                    self.parameters('image_transport: compressed, depth_image_transport: compressedDepth'))

    def test_03_a_transport_that_is_not_there_ends_the_launch(self):
        done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch',
                               'sensor:=' + os.path.join(self.data, 'smoke_sensor.yaml'),
                               'params:=' + self.parameters('image_transport: smoke_signals')],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)
        self.assertIn("image transport 'smoke_signals' of %s: not installed; there are: compressed, " % COLOR, done.stdout)


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'compressed_test', CompressedTest)
