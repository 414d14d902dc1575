#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""run_bag: every file it promises, the same bits twice, and results when it is interrupted."""
import filecmp
import os
import signal
import subprocess
import tempfile
import unittest

import numpy as np
import rostest
import rospy
import yaml

FILES = ('trajectory.tum', 'realtime.tum', 'odometry.tum', 'planes.yaml', 'planes.ply', 'map.vsm', 'floorplan.svg',
         'plane_history.csv', 'timing.csv', 'summary.yaml', 'report.html')


class OfflineTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('offline_test')
        cls.data = rospy.get_param('~data')
        cls.folder = tempfile.mkdtemp()

    def command(self, out, *more, bag='smoke'):
        return ['rosrun', 'vip_slam_bringup', 'run_bag', os.path.join(self.data, bag + '.bag'), '--sensor',
                os.path.join(self.data, bag + '_sensor.yaml'), '--out', os.path.join(self.folder, out), *more]

    def summary(self, out):
        with open(os.path.join(self.folder, out, 'summary.yaml')) as file:
            return yaml.safe_load(file)

    def localise(self, out, stored):
        subprocess.run(self.command(out, '--map', stored, '--localise', '--no-report'), check=True, timeout=120)
        mapped, found = (np.loadtxt(os.path.join(self.folder, name, 'trajectory.tum')) for name in ('a', out))
        _, i, j = np.intersect1d(mapped[:, 0], found[:, 0], return_indices=True)
        self.assertGreater(len(i), 0.9 * len(mapped))
        error = np.linalg.norm(mapped[i, 1:4] - found[j, 1:4], axis=1)
        self.assertLess(np.median(error), 0.01)
        self.assertLess(error.max(), 0.05)

    def test_01_two_runs_give_the_same_bits(self):
        for out in ('a', 'b'):
            subprocess.run(self.command(out), check=True, timeout=120)
        for name in FILES:
            self.assertGreater(os.path.getsize(os.path.join(self.folder, 'a', name)), 0, name)
        for name in FILES[:7]:
            a, b = (os.path.join(self.folder, out, name) for out in ('a', 'b'))
            self.assertTrue(filecmp.cmp(a, b, shallow=False), name)
        summary = self.summary('a')
        self.assertTrue(summary['finished'])
        self.assertGreater(summary['tracked_images'], 0.8 * summary['images'])
        self.assertGreater(summary['planes'], 3)

    def test_02_an_interrupted_run_writes_what_there_is(self):
        process = subprocess.Popen(self.command('c', '--no-report'), stderr=subprocess.PIPE, text=True)
        path = os.path.join(self.folder, 'c')
        for line in process.stderr:
            if ' 30%' in line:
                process.send_signal(signal.SIGINT)
        process.wait(60)
        self.assertFalse(self.summary('c')['finished'])
        self.assertGreater(len(np.loadtxt(os.path.join(path, 'odometry.tum'))), 0)

    def test_03_a_part_of_the_bag(self):
        subprocess.run(self.command('d', '--start', '2', '--duration', '5', '--variant', 'vi', '--loop', 'off',
                                    '--no-report'), check=True, timeout=120)
        summary = self.summary('d')
        self.assertEqual((summary['variant'], summary['loop_closing'], summary['planes']), ('vi', False, 0))
        self.assertLess(abs(summary['images'] - 100), 3)

    def test_04_localisation_only_gives_the_trajectory_in_the_stored_map(self):
        stored = os.path.join(self.folder, 'a', 'map.vsm')
        self.localise('e', stored)
        self.assertTrue(filecmp.cmp(stored, os.path.join(self.folder, 'e', 'map.vsm'), shallow=False))

    def test_05_the_launch_file_does_the_same(self):
        out = os.path.join(self.folder, 'f')
        subprocess.run(['roslaunch', 'vip_slam_bringup', 'offline.launch', 'bag:=' + self.data + '/smoke.bag',
                        'sensor:=' + self.data + '/smoke_sensor.yaml', 'out:=' + out, 'loop:=false'],
                       check=True, timeout=120)
        self.assertFalse(self.summary('f')['loop_closing'])
        self.assertTrue(filecmp.cmp(os.path.join(self.folder, 'a', 'odometry.tum'), os.path.join(out, 'odometry.tum'),
                                    shallow=False))

    def test_06_nothing_of_an_earlier_run_stays(self):
        for name in FILES:
            open(os.path.join(self.folder, 'd', name), 'a').close()
        subprocess.run(self.command('d', '--duration', '3', '--set', 'mapping=false', '--no-report'), check=True,
                       timeout=120)
        self.assertEqual(sorted(os.listdir(os.path.join(self.folder, 'd'))),
                         ['odometry.tum', 'odometry_covariance.csv', 'summary.yaml', 'timing.csv'])

    def test_07_another_room_is_kept_as_a_part_of_the_stored_map(self):
        stored = os.path.join(self.folder, 'a', 'map.vsm')
        subprocess.run(self.command('g', '--no-report', bag='other_room'), check=True, timeout=120)
        subprocess.run(self.command('h', '--map', stored, '--no-report', bag='other_room'), check=True, timeout=120)
        alone, both = self.summary('g'), self.summary('h')
        self.assertGreater(alone['keyframes'], 2)
        self.assertEqual(both['keyframes'], self.summary('a')['keyframes'] + alone['keyframes'])
        self.assertTrue(any('never tied to the rest of the map' in words for words in both['warnings']))
        paths = [np.loadtxt(os.path.join(self.folder, out, 'trajectory.tum')) for out in ('g', 'h')]
        self.assertEqual(len(paths[0]), len(paths[1]))
        # The room that was stored is found in it as before.
        self.localise('i', os.path.join(self.folder, 'h', 'map.vsm'))


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'offline_test', OfflineTest)
