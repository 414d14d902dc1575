#!/usr/bin/python3
"""What users get wrong is named: by the launch, by the tracking status, by run_bag."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from vip_slam_msgs.msg import TrackingStatus

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, wait_for  # noqa: E402


class BadInputTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('bad_input_test')
        cls.data = rospy.get_param('~data')
        cls.folder = tempfile.mkdtemp()

    def run_bag(self, bag, sensor, *more):
        command = ['rosrun', 'vip_slam_bringup', 'run_bag', bag, '--sensor', sensor, '--out',
                   os.path.join(self.folder, 'out'), *more]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)
        return done.returncode, done.stdout

    def sensor_with(self, pattern, replacement):
        with open(os.path.join(self.data, 'smoke_sensor.yaml')) as file:
            text, count = re.subn(pattern, replacement, file.read())
        self.assertGreater(count, 0)
        path = os.path.join(self.folder, 'sensor.yaml')
        with open(path, 'w') as file:
            file.write(text)
        return path

    def test_01_unknown_sensor_ends_the_launch(self):
        done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=kinect_9000'],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)
        self.assertIn('kinect_9000', done.stdout)
        self.assertIn('d435i', done.stdout, 'the shipped sensors are listed')

    def test_02_wrong_topic_is_named(self):
        sensor = self.sensor_with(r'(color: )\S+image_raw\S*', r'\1"/nowhere/image_raw"')
        status = Listener('/wrong/tracking_status', TrackingStatus)
        diagnostics = Listener('/diagnostics', DiagnosticArray)
        launch = subprocess.Popen(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=' + sensor, 'ns:=wrong'],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: status.last() and '/nowhere/image_raw' in status.last().reason, 30,
                     'a tracking status that names the topic')
            self.assertEqual(status.last().state, TrackingStatus.WAITING)
            wait_for(lambda: any('/nowhere/image_raw' in s.message for m in diagnostics.all() for s in m.status), 30,
                     'diagnostics that name the topic')
        finally:
            launch.terminate()
            launch.wait(30)

    def test_03_wrong_parameter_ends_the_launch(self):
        parameters = os.path.join(self.folder, 'parameters.yaml')
        with open(parameters, 'w') as file:
            file.write('frontend: {tracking: {max_featurez: 100}}\n')
        sensor = os.path.join(self.data, 'smoke_sensor.yaml')
        done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=' + sensor,
                               'params:=' + parameters], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=60)
        self.assertIn('max_featurez', done.stdout)

    def test_04_run_bag_names_what_is_missing(self):
        bag, sensor = os.path.join(self.data, 'smoke.bag'), os.path.join(self.data, 'smoke_sensor.yaml')
        code, words = self.run_bag(bag, 'kinect_9000')
        self.assertNotEqual(code, 0)
        self.assertIn('kinect_9000', words)
        code, words = self.run_bag(os.path.join(self.folder, 'none.bag'), sensor)
        self.assertNotEqual(code, 0)
        self.assertIn('none.bag', words)
        broken = os.path.join(self.folder, 'broken.bag')
        with open(bag, 'rb') as source, open(broken, 'wb') as target:
            target.write(source.read(3000000))
        code, words = self.run_bag(broken, sensor)
        self.assertNotEqual(code, 0)
        self.assertIn('broken.bag', words)
        code, words = self.run_bag(bag, self.sensor_with(r'(depth: )\S+image_raw\S*', r'\1"/nowhere/depth"'))
        self.assertNotEqual(code, 0)
        self.assertIn('/nowhere/depth', words)
        self.assertIn('/camera/color/image_raw', words, 'the topics of the bag are listed')
        code, words = self.run_bag(bag, sensor, '--set', 'frontend/tracking/max_featurez=3')
        self.assertNotEqual(code, 0)
        self.assertIn('max_featurez', words)


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'bad_input_test', BadInputTest)
