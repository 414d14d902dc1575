#!/usr/bin/python3
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

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import load_tum, position_error  # noqa: E402


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

    def test_folder_to_trajectory(self):
        self.rosrun('render_euroc_folder', self.path('V9_99'))
        words = self.rosrun('convert_to_bag', 'euroc', self.path('V9_99'), '--depth', '--out', self.path('euroc.bag'))
        self.assertIn('/stereo/depth/image', words)
        self.rosrun('check_bag', self.path('euroc.bag'), '--sensor', 'euroc')
        self.rosrun('run_bag', self.path('euroc.bag'), '--sensor', 'euroc', '--out', self.path('out'), '--no-report')
        truth, estimate = load_tum(self.path('euroc_truth.tum')), load_tum(self.path('out', 'trajectory.tum'))
        self.assertGreater(estimate[-1, 0] - estimate[0, 0], 7)
        self.assertLess(position_error(truth, estimate), 0.01)


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'euroc_test', EurocTest)
