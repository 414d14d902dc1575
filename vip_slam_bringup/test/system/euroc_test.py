#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""EuRoC from end to end: a rendered folder of the stereo pair to a bag with depth, run offline and judged; then the raw
pair through the nodelets."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
import tf2_ros
from sensor_msgs.msg import Image

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, load_tum, position_error, wait_for  # noqa: E402


class EurocTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('euroc_test')
        cls.folder = tempfile.mkdtemp()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def rosrun(self, *command):
        done = subprocess.run(['rosrun', 'vip_slam_bringup', *command], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=200)
        self.assertEqual(done.returncode, 0, done.stdout[-2000:])
        return done.stdout

    def test_01_folder_to_trajectory(self):
        self.rosrun('render_euroc_folder', self.path('V9_99'))
        words = self.rosrun('convert_to_bag', 'euroc', self.path('V9_99'), '--depth', '--out', self.path('euroc.bag'))
        self.assertIn('/stereo/depth/image', words)
        self.rosrun('check_bag', self.path('euroc.bag'), '--sensor', 'euroc')
        self.rosrun('run_bag', self.path('euroc.bag'), '--sensor', 'euroc', '--out', self.path('out'), '--no-report')
        truth, estimate = load_tum(self.path('euroc_truth.tum')), load_tum(self.path('out', 'trajectory.tum'))
        self.assertGreater(estimate[-1, 0] - estimate[0, 0], 7)
        self.assertLess(position_error(truth, estimate), 0.01)

    def test_02_the_raw_pair_through_the_nodelet(self):
        depth, buffer = Listener('/stereo/depth/image', Image), tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        live = subprocess.Popen(['roslaunch', '--no-summary', 'vip_slam_bringup', 'stereo_depth.launch'])
        try:
            wait_for(lambda: depth.subscriber.get_num_connections(), 30, 'the nodelet')
            play = ['rosbag', 'play', '--quiet', '--wait-for-subscribers', '--duration', '3', self.path('euroc.bag'),
                    '--topics', '/cam0/image_raw', '/cam1/image_raw']
            subprocess.run(play, check=True, timeout=60)
            image = wait_for(depth.last, 10, 'depth')
        finally:
            live.terminate()
            live.wait()
        self.assertEqual((image.header.frame_id, image.encoding), ('cam0_rectified', '32FC1'))
        # Rectifying turns the camera a little: tf says so, and nothing else.
        turn = buffer.lookup_transform('cam0', 'cam0_rectified', rospy.Time(0)).transform
        self.assertGreater(turn.rotation.w, 0.999)
        self.assertLess(turn.rotation.w, 1.0)
        self.assertEqual((turn.translation.x, turn.translation.y, turn.translation.z), (0, 0, 0))


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'euroc_test', EurocTest)
