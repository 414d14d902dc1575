#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Nodelets die in the middle of a run: with respawn everything comes back, and the map's planes stay."""
import os
import sys
import time
import unittest

import rosnode
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from vip_slam_msgs.msg import Keyframe, MapUpdate, PlaneUpdate, TrackedFrame

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, wait_for  # noqa: E402

SESSION = 1 << 20  # epochs of a front end that was started a second time begin here


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

    def test_2_front_end_restarts(self):
        # Its odometry is a new part of the map: new numbers, and no pose by the old odometry's place in the map.
        arrived = {'frame': [], 'pose': [], 'place': []}  # wall times; the stamps begin again with each loop of the bag

        def note(what, wanted=lambda _: True):
            return lambda m: arrived[what].append(time.time()) if wanted(m) else None
        keyframes = Listener('/vip_slam/keyframe', Keyframe)
        subscribers = [
            rospy.Subscriber('/vip_slam/tracked_frame', TrackedFrame, note('frame', lambda m: m.epoch >= SESSION)),
            rospy.Subscriber('/vip_slam/pose', PoseWithCovarianceStamped, note('pose')),
            rospy.Subscriber('/vip_slam/map_update', MapUpdate, note('place', lambda m: m.epoch >= SESSION and m.placed))]
        keyframes.wait(5, 40, 'keyframes')
        rosnode.kill_nodes(['/vip_slam/frontend'])
        again = wait_for(lambda: [k for k in keyframes.all() if k.frame.epoch >= SESSION], 40, 'the front end again')[0]
        before = [k for k in keyframes.all() if k.frame.epoch < SESSION]
        self.assertGreater(again.id, max(k.id for k in before))
        self.assertFalse({f.id for f in again.frame.features if f.id >= 0} & {f.id for k in before for f in k.frame.features})
        wait_for(lambda: arrived['place'], 60, 'its place in the map')
        wait_for(lambda: arrived['pose'][-1] > arrived['place'][0], 20, 'poses in the map again')
        slack = 0.3  # seconds: messages of two topics are not ordered
        early = [t for t in arrived['pose'] if arrived['frame'][0] + slack < t < arrived['place'][0] - slack]
        self.assertFalse(early, 'poses while the place is not known')
        for subscriber in subscribers:
            subscriber.unregister()

    def test_3_manager_restarts(self):
        odometry = Listener('/vip_slam/odom', Odometry)
        odometry.wait(10, 40, 'odometry')
        killed, failed = rosnode.kill_nodes(['/vip_slam/manager'])
        self.assertEqual(killed, ['/vip_slam/manager'])
        time.sleep(2)
        odometry.wait(10, 40, 'odometry after the manager has been killed')


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'restart_test', RestartTest)
