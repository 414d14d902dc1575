#!/usr/bin/python3
"""The nodelet manager dies in the middle of a run: with respawn everything comes back."""
import os
import sys
import time
import unittest

import rosnode
import rospy
import rostest
from nav_msgs.msg import Odometry

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener  # noqa: E402


class RestartTest(unittest.TestCase):
    def test_manager_restarts(self):
        rospy.init_node('restart_test')
        odometry = Listener('/vip_slam/odom', Odometry)
        odometry.wait(10, 40, 'odometry')
        killed, failed = rosnode.kill_nodes(['/vip_slam/manager'])
        self.assertEqual(killed, ['/vip_slam/manager'])
        time.sleep(2)
        odometry.wait(10, 40, 'odometry after the manager has been killed')


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'restart_test', RestartTest)
