#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet against the stand-in, which plays a small bag made here: a textured wall, a phone that lies still."""
import os
import shutil
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np
import rosbag
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import CameraInfo, Image, Imu

SENSOR = """
name: test
topics: {color: /c, color_info: /ci, depth: /d, depth_info: /di, imu: /i, gyro: "", accel: ""}
color: {encoding: mono8, rate: 20, rolling_shutter: 0}
depth: {encoding: 16UC1, scale: 0.001, offset: 0, shift: [0, 0], curve: [], rate: 20, registered: true, rolling_shutter: 0}
intrinsics_from_camera_info: false
camera: {model: none, width: 320, height: 240, fx: 260.0, fy: 260.0, cx: 159.5, cy: 119.5, distortion: []}
T_imu_cam: [[0, -1, 0, 0.03], [-1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]
T_base_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
imu: {rate: 100, gyro_noise_density: 1.0e-3, gyro_random_walk: 1.0e-5, accel_noise_density: 1.0e-2,
      accel_random_walk: 1.0e-4, gyro_correction: [[0, 0, 0], [0, 0, 0], [0, 0, 0]], gyro_correction_sigma: 0.005, gravity: 9.81}
depth_noise: {model: tof, a: 0.005, b: 0.005, c: 0.0, min_range: 0.25, max_range: 5.0, bias_floor: 0.01}
time_offset: 0.0
"""
SECONDS, RATE = 8, 20


class Keep:
    """Messages of a topic with the time of their arrival."""

    def __init__(self, topic, kind):
        self.all = []
        self.subscriber = rospy.Subscriber(topic, kind, lambda m: self.all.append((time.time(), m)), queue_size=2000)

    def clear(self):
        self.all = []


class PhoneTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('phone_test')
        cls.folder = tempfile.mkdtemp()
        cls.bag, cls.sensor = os.path.join(cls.folder, 'wall.bag'), os.path.join(cls.folder, 'sensor.yaml')
        with open(cls.sensor, 'w', encoding='utf-8') as file:
            file.write(SENSOR)
        v, u = np.mgrid[0:240, 0:320]
        wall = (128 + 60 * np.sin(u / 9.) + 50 * np.cos(v / 7.)).astype(np.uint8)
        with rosbag.Bag(cls.bag, 'w') as out:
            for k in range(SECONDS * 100):
                stamp = rospy.Time(1000 + k / 100.)
                imu = Imu()
                imu.header.stamp = stamp
                imu.linear_acceleration.y = 9.80665
                imu.angular_velocity.x = 0.01
                out.write('/i', imu, stamp)
                if k % (100 // RATE):
                    continue
                for topic, encoding, pixels in (('/c', 'mono8', wall), ('/d', '16UC1', np.full((240, 320), 2000, np.uint16))):
                    image = Image(encoding=encoding, width=320, height=240, step=320 * pixels.itemsize, data=pixels.tobytes())
                    image.header.stamp = stamp
                    out.write(topic, image, stamp)
        cls.color, cls.depth = Keep('/phone/color/image_raw', Image), Keep('/phone/depth/image_raw', Image)
        cls.info, cls.imu = Keep('/phone/color/camera_info', CameraInfo), Keep('/phone/imu', Imu)
        cls.diagnostics = Keep('/diagnostics', DiagnosticArray)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def play(self, *more, port=28554, beside=lambda: None):
        for keep in (self.color, self.depth, self.info, self.imu, self.diagnostics):
            keep.clear()
        play = subprocess.Popen(['rosrun', 'vip_slam_phone', 'phone_stand_in', self.bag, '--sensor', self.sensor,
                                 '--rtsp-port', str(port), '--record-port', str(port + 1), '--depth-port', str(port + 2),
                                 '--wait', '5', *more], stdout=subprocess.PIPE, text=True)
        try:
            begin = float(play.stdout.readline().split()[1])
            beside()
            words, _ = play.communicate(timeout=40)
        finally:
            play.kill()
        self.assertEqual(play.returncode, 0, words)
        return begin

    def check_stamps(self, keep, begin):
        """Stamps are the bag's on our clock, though the phone's is a day ahead, and its images' are ends of exposures."""
        stamps = np.array([m.header.stamp.to_sec() for _, m in keep.all])
        self.assertTrue((np.diff(stamps) > 0).all())
        nearest = np.round((stamps - begin - 1000) * RATE) / RATE
        late = stamps - begin - 1000 - nearest
        self.assertLess(late.std(), 0.001)
        self.assertGreater(late.min(), -0.001)  # what the shortest way takes
        self.assertLess(late.max(), 0.02)
        return stamps

    def test_01_all_of_it_on_one_clock_and_one_camera(self):
        begin = self.play('--piece', '100')
        # The first second finds the clock.
        for keep in (self.color, self.depth):
            stamps = self.check_stamps(keep, begin)
            self.assertGreater(len(stamps), (SECONDS - 1.5) * RATE)
            self.assertLess(np.diff(stamps).max(), 1.5 / RATE, 'an image is lost')
        self.assertGreater(len(self.imu.all), (SECONDS - 1.5) * 100)
        self.assertEqual(len({tuple(m.K) for _, m in self.info.all}), 1)
        self.assertAlmostEqual(self.imu.all[0][1].linear_acceleration.y, 9.80665, 4)
        self.assertAlmostEqual(self.imu.all[0][1].angular_velocity.x, 0.01, 6)
        first, last = self.color.all[20][1], self.color.all[-1][1]
        self.assertEqual((first.width, first.height, first.encoding), (160, 120, 'bgr8'))
        # The focus breathes, the images do not.
        images = [np.frombuffer(m.data, np.uint8).reshape(120, 160, 3)[15:-15, 20:-20].astype(float) for m in (first, last)]
        self.assertLess(np.abs(images[0] - images[1]).mean(), 4)
        depth = np.frombuffer(self.depth.all[-1][1].data, np.uint16).reshape(120, 160)
        self.assertTrue((depth[15:-15, 20:-20] == 2000).all())

    def test_02_broken_connections_and_lost_packets(self):
        begin = self.play('--reconnect', '4', '--lose', '30')
        self.check_stamps(self.color, begin)
        stamps = np.array([m.header.stamp.to_sec() for _, m in self.color.all]) - begin - 1000
        self.assertGreater(stamps[-1], SECONDS - 1)
        self.assertGreater(np.diff(stamps).max(), 0.5, 'nothing broke')
        words = ' '.join(s.message for _, m in self.diagnostics.all for s in m.status)
        self.assertIn('packets of the video were lost', words)

    def test_03_another_player_reads_the_video(self):
        if not shutil.which('ffprobe'):
            self.skipTest('ffprobe (package ffmpeg) is not installed')
        seen = []
        command = ['ffprobe', '-v', 'quiet', '-rtsp_transport', 'tcp', '-show_entries', 'stream=codec_name,width', '-of',
                   'csv=p=0', 'rtsp://127.0.0.1:28564/live']
        # Ports of its own: the nodelet would take its place.
        self.play(port=28564, beside=lambda: seen.append(
            subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=30).stdout))
        self.assertIn('h264,320', seen[0])

    def test_04_hevc(self):
        said = subprocess.run(['rosrun', 'vip_slam_phone', 'phone_stand_in', '--codec', 'hevc'], stderr=subprocess.PIPE,
                              text=True).stderr
        if 'no encoder' in said:
            self.skipTest('libavcodec has no libx265')
        stamps = self.check_stamps(self.color, self.play('--codec', 'hevc'))
        self.assertGreater(len(stamps), (SECONDS - 1.5) * RATE)
        self.assertLess(np.diff(stamps).max(), 1.5 / RATE, 'an image is lost')


if __name__ == '__main__':
    rostest.rosrun('vip_slam_phone', 'phone', PhoneTest)
