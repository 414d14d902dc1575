#!/usr/bin/python3
"""Nodelets die in the middle of a run: with respawn everything comes back, and the map's planes stay."""
import os
import sys
import time
import unittest

import rosnode
import rospy
import rostest
from nav_msgs.msg import Odometry
from vip_slam_msgs.msg import PlaneUpdate

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, wait_for  # noqa: E402


class RestartTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('restart_test')

    def test_1_planes_restart(self):
        # The plane nodelet begins anew, and the back end gives it the planes that the map has.
        updates = Listener('/vip_slam/plane_update', PlaneUpdate)
        wait_for(lambda: updates.last() and len(updates.last().planes) >= 5, 40, 'five planes')
        first = updates.last().session
        before = {plane.id for plane in updates.last().planes if plane.area > 1}
        rosnode.kill_nodes(['/vip_slam/planes'])
        restored = wait_for(lambda: [u for u in updates.all() if u.session != first and u.restored], 40, 'a new session')
        self.assertLessEqual(before, {plane.id for plane in restored[0].planes})

    def test_2_manager_restarts(self):
        odometry = Listener('/vip_slam/odom', Odometry)
        odometry.wait(10, 40, 'odometry')
        killed, failed = rosnode.kill_nodes(['/vip_slam/manager'])
        self.assertEqual(killed, ['/vip_slam/manager'])
        time.sleep(2)
        odometry.wait(10, 40, 'odometry after the manager has been killed')


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'restart_test', RestartTest)
