#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""phone.launch against the stand-in that plays the rendered sequence: poses, error, nothing lost, and the map stays."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import rosgraph
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo
from vip_slam_msgs.msg import MapUpdate, PlaneUpdate, TrackingStatus
from vip_slam_msgs.srv import SaveTrajectory, TriggerGlobalBa

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, alignment, load_tum, position_error, positions_at, tracking, wait_for  # noqa: E402

NS = '/vip_slam/'
PORTS = {'rtsp': 28754, 'record': 28755, 'depth': 28756}  # below those that systems give to whoever connects
START = 3.0  # s: the receiver finds the clock, the estimator its state; 1.3 s where nothing else runs


def sensor_of_the_phone(data, folder):
    """The shipped phone.yaml with the lever arm and the noise of the rendered IMU, as a calibration gives them."""
    shipped = os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', '..', 'config', 'sensors', 'phone.yaml')
    with open(shipped, encoding='utf-8') as file:
        phone = yaml.safe_load(file)
    with open(os.path.join(data, 'smoke_sensor.yaml'), encoding='utf-8') as file:
        rendered = yaml.safe_load(file)
    of_phone, of_bag = np.array(phone['T_imu_cam'], float), np.array(rendered['T_imu_cam'], float)
    # The stand-in turns the IMU's samples into the phone's axes.
    of_phone[:3, 3] = of_phone[:3, :3] @ of_bag[:3, :3].T @ of_bag[:3, 3]
    phone.update(T_imu_cam=of_phone.tolist(), imu=rendered['imu'], depth_noise=rendered['depth_noise'])
    for stream in ('color', 'depth'):
        phone[stream]['rate'] = rendered[stream]['rate']
    path = os.path.join(folder, 'phone_sensor.yaml')
    with open(path, 'w', encoding='utf-8') as file:
        yaml.safe_dump(phone, file)
    return path


class Timed(Listener):
    """Remembers how long after its stamp each message came, s."""

    def __init__(self, topic, kind):
        self.ages = []
        super().__init__(topic, kind)

    def add(self, message):
        stamp = message.header.stamp.to_sec()
        self.ages.append((stamp, time.time() - stamp))
        super().add(message)

    def told(self, begin):
        """From a stamp on: the first images wait for the clock."""
        ages = [age for stamp, age in self.ages if stamp >= begin]
        return 'median %.1f ms, 99 %% within %.1f ms' % tuple(1e3 * np.percentile(ages, (50, 99)))


class PhoneTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('phone_test')
        cls.data = rospy.get_param('~data')
        cls.truth = load_tum(os.path.join(cls.data, 'smoke_truth.tum'))
        cls.folder = tempfile.mkdtemp()
        cls.odometry = Timed(NS + 'odom', Odometry)
        cls.pose = Listener(NS + 'pose', PoseWithCovarianceStamped)
        cls.status = Listener(NS + 'tracking_status', TrackingStatus)
        cls.planes = Listener(NS + 'plane_update', PlaneUpdate)
        cls.updates = Listener(NS + 'map_update', MapUpdate)
        cls.images = Timed('/phone/color/camera_info', CameraInfo)
        cls.diagnostics = Listener('/diagnostics', DiagnosticArray)
        sensor = sensor_of_the_phone(cls.data, cls.folder)
        cls.launch = subprocess.Popen(
            ['roslaunch', '--no-summary', 'vip_slam_bringup', 'phone.launch', 'host:=127.0.0.1', 'rviz:=false',
             'extrinsics:=config', 'sensor:=' + sensor] + ['%s_port:=%d' % p for p in PORTS.items()])

    @classmethod
    def tearDownClass(cls):
        cls.launch.terminate()
        cls.launch.wait(30)
        shutil.rmtree(cls.folder)

    def play(self):
        """Plays the sequence; what its clock is behind ours by, s."""
        play = subprocess.Popen(
            ['rosrun', 'vip_slam_phone', 'phone_stand_in', os.path.join(self.data, 'smoke.bag'), '--sensor',
             os.path.join(self.data, 'smoke_sensor.yaml'), '--wait', '4'] +
            [word for name, port in PORTS.items() for word in ('--%s-port' % name, str(port))],
            stdout=subprocess.PIPE, text=True)
        try:
            words, _ = play.communicate(timeout=60)
        finally:
            play.kill()
        self.assertEqual(play.returncode, 0, words)
        print(words)
        # Stamps are late by what the first second's messages were: then they are not those of the truth.
        self.assertLess(float(re.search('median ([0-9.]+) ms', words).group(1)), 1000,
                        'this machine is too busy: the stand-in fell behind real time')
        return float(words.split()[1])

    def words(self):
        return ' '.join(s.message for m in self.diagnostics.all() for s in m.status if s.name.endswith(': phone'))

    def poses(self, listener, ahead):
        """Rows of a time of the truth's clock and a position, of one playing."""
        rows = [[m.header.stamp.to_sec() - ahead, m.pose.pose.position.x, m.pose.pose.position.y, m.pose.pose.position.z]
                for m in listener.all()]
        return np.array([r for r in rows if self.truth[0, 0] <= r[0] <= self.truth[-1, 0]])

    def call(self, name, kind, *arguments):
        answer = rospy.ServiceProxy(NS + name, kind)(*arguments)
        self.assertTrue(answer.success, answer.message)

    def error_of_the_map(self, ahead):
        """After a last adjustment, as scripts/play_sequence judges a bag."""
        path = os.path.join(self.folder, 'trajectory.tum')
        before = self.updates.count()
        self.call('trigger_global_ba', TriggerGlobalBa)
        wait_for(lambda: any(m.global_update for m in self.updates.all()[before:]), 20, 'an adjusted map')
        self.call('save_trajectory', SaveTrajectory, path)
        return position_error(self.truth + np.array([ahead] + 7 * [0]), load_tum(path))

    def test_1_follows_the_truth_and_loses_nothing(self):
        wait_for(lambda: 'the phone does not answer' in self.words(), 60, 'words about a phone that is not there')
        ahead = self.play()
        type(self).first = ahead
        self.assertTrue(tracking(self.status.last()))
        odometry = self.poses(self.odometry, ahead)
        duration = self.truth[-1, 0] - self.truth[0, 0]
        self.assertGreater(odometry[-1, 0] - odometry[0, 0], duration - START)
        self.assertLess(np.diff(odometry[:, 0]).max(), 0.075, 'images come at 20 Hz')
        images = {m.header.stamp for m in self.images.all()}
        self.assertEqual({m.header.stamp for m in self.odometry.all()} - images, set())
        error = position_error(self.truth, odometry)
        map_error = self.error_of_the_map(ahead)
        print('error of the odometry: %.4f m, of the map: %.4f m, %d poses' % (error, map_error, len(odometry)))
        begin = ahead + self.truth[0, 0] + START
        print('from mid-exposure to the received image: %s; to the odometry: %s; load average %.1f' %
              (self.images.told(begin), self.odometry.told(begin), os.getloadavg()[0]))
        self.assertLess(error, 0.01)
        self.assertLess(map_error, 0.01)

    def test_2_the_manager_takes_raw_images(self):
        subscribers = dict(rosgraph.Master('/phone_test').getSystemState()[1])
        for name in ('color', 'depth'):
            topic = '/phone/%s/image_raw' % name
            self.assertIn(NS + 'manager', subscribers.get(topic, []))
            self.assertNotIn(topic + '/compressed', subscribers)

    def test_3_a_phone_that_comes_back_finds_its_map(self):
        said = len(self.diagnostics.all())
        wait_for(lambda: 'the phone does not answer' in ' '.join(
            s.message for m in self.diagnostics.all()[said:] for s in m.status), 30, 'words about the phone that left')
        before = self.planes.last()
        first = self.poses(self.pose, self.first)
        R, t = alignment(first[:, 1:], positions_at(self.truth, first[:, 0]))
        ahead = self.play()
        after = self.planes.last()
        self.assertEqual(after.session, before.session)
        self.assertLessEqual({p.id for p in before.planes if p.area > 1}, {p.id for p in after.planes})
        # In the map of the first time the poses are those of the truth.
        second = self.poses(self.pose, ahead)
        truth = positions_at(self.truth, second[:, 0])
        error = np.linalg.norm(second[:, 1:] @ R.T + t - truth, axis=1)
        print('distance from the truth in the map of the first time, every second: %s m' % np.round(error[::20], 3))
        self.assertLess(error[-20:].max(), 0.03)


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'phone_test', PhoneTest)
