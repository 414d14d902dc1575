#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What users get wrong is named: by the launch, by the tracking status, by run_bag."""
import csv
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import rosbag
import rosgraph
import rospy
import rostest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from vip_slam_msgs.msg import TrackedFrame, TrackingStatus
from vip_slam_msgs.srv import SaveMap, SaveTrajectory

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from live import Listener, wait_for  # noqa: E402


def copy_bag(source, target, seconds, change):
    """The first seconds of a bag, every message as change(topic, message, number on its topic) returns it, or left out."""
    counts = {}
    with rosbag.Bag(source) as bag, rosbag.Bag(target, 'w') as out:
        begin = bag.get_start_time()
        for topic, message, stamp in bag.read_messages():
            if stamp.to_sec() - begin > seconds:
                break
            counts[topic] = counts.get(topic, -1) + 1
            message = change(topic, message, counts[topic])
            if message is not None:
                out.write(topic, message, stamp)


def halve_depth(topic, message, _):
    if 'aligned_depth' in topic and message._type == 'sensor_msgs/Image':
        half = np.frombuffer(message.data, np.uint16).reshape(message.height, message.width)[::2, ::2]
        message.height, message.width = half.shape
        message.step, message.data = 2 * message.width, half.tobytes()
    return message


def thin_depth(topic, message, number):
    return None if 'aligned_depth' in topic and number % 3 else message


def spoil_encoding(topic, message, _):
    if topic.endswith('color/image_raw'):
        message.encoding = 'foo8'
    return message


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
        launch = subprocess.Popen(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=' + sensor,
                                   'ns:=wrong'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: status.last() and '/nowhere/image_raw' in status.last().reason, 30,
                     'a tracking status that names the topic')
            self.assertEqual(status.last().state, TrackingStatus.WAITING)
            wait_for(lambda: any('/nowhere/image_raw' in s.message for m in diagnostics.all() for s in m.status), 30,
                     'diagnostics that name the topic')
            for topic in ('odom', 'pose'):
                wait_for(lambda name=topic: any(
                    s.name.endswith(name + ' topic status') and s.level == DiagnosticStatus.ERROR
                    for m in diagnostics.all() for s in m.status), 30, 'the rate of %s, which is none' % topic)
        finally:
            launch.terminate()
            launch.wait(30)

    def test_02b_missing_depth_is_named(self):
        sensor = self.sensor_with(r'(depth: )\S+image_raw\S*', r'\1"/nowhere/depth"')
        status = Listener('/vip_slam/tracking_status', TrackingStatus)
        launch = subprocess.Popen(['roslaunch', 'vip_slam_bringup', 'bag.launch', 'sensor:=' + sensor, 'rviz:=false',
                                   'bag:=' + os.path.join(self.data, 'smoke.bag')], stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)
        try:
            wait_for(lambda: any('/nowhere/depth: no message so far; nobody publishes it' in s.reason
                                 for s in status.all()), 40, 'a tracking status that names the topic of depth')
        finally:
            launch.terminate()
            words, _ = launch.communicate(timeout=30)
        self.assertIn('no depth, no planes: topic /nowhere/depth', words)

    def test_02c_the_topic_after_remapping_and_an_unknown_host_are_named(self):
        launch_file = os.path.join(self.folder, 'remapped.launch')
        with open(launch_file, 'w') as file:
            file.write('<launch><param name="/use_sim_time" value="false"/>'
                       '<remap from="/camera/color/image_raw" to="/elsewhere/image"/><include file="$(find '
                       'vip_slam_bringup)/launch/vip_slam.launch"><arg name="sensor" value="%s"/></include></launch>'
                       % os.path.join(self.data, 'smoke_sensor.yaml'))
        status = Listener('/vip_slam/tracking_status', TrackingStatus)
        ghost, uri = rosgraph.Master('/ghost'), 'http://no-such-host.invalid:5/'
        ghost.registerPublisher('/elsewhere/image', 'sensor_msgs/Image', uri)
        launch = subprocess.Popen(['roslaunch', launch_file], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: any('/elsewhere/image: no message so far' in s.reason for s in status.all()), 30,
                     'the topic that is listened to')
            wait_for(lambda: any("/ghost runs on host 'no-such-host.invalid', whose name cannot be resolved" in s.reason
                                 for s in status.all()), 40, 'the host')
        finally:
            ghost.unregisterPublisher('/elsewhere/image', uri)
            launch.terminate()
            launch.wait(30)

    def test_02d_check_bag_runs_the_odometry(self):
        # A temporal filter in the driver: every image, stamp and edge of depth is as it should be.
        source, filtered = os.path.join(self.data, 'smoke.bag'), os.path.join(self.folder, 'filtered.bag')
        before = None
        with rosbag.Bag(source) as bag, rosbag.Bag(filtered, 'w') as out:
            for topic, message, t in bag.read_messages():
                if topic == '/camera/aligned_depth_to_color/image_raw':
                    depth = np.frombuffer(message.data, np.uint16).astype(float)
                    if before is not None:
                        near = (depth > 0) & (before > 0) & (np.abs(depth - before) < 100)
                        depth = np.where(near, 0.15 * depth + 0.85 * before, depth)
                    before = depth
                    message.data = depth.astype(np.uint16).tobytes()
                out.write(topic, message, t)
        sensor = os.path.join(self.data, 'smoke_sensor.yaml')
        for bag, status, words in ((source, 0, 'ok       odometry:'), (filtered, 1, 'ERROR    odometry:')):
            done = subprocess.run(['rosrun', 'vip_slam_bringup', 'check_bag', bag, '--sensor', sensor],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120)
            self.assertEqual(done.returncode, status, done.stdout)
            self.assertIn(words, done.stdout)
        os.remove(filtered)

    def test_03_wrong_parameter_ends_the_launch(self):
        # What one of these launches leaves on the server is not the next one's.
        sensor = os.path.join(self.data, 'smoke_sensor.yaml')
        for wrong, name in (('tracking: {max_featurez: 100}', 'tracking/max_featurez'),
                            ('trackink: {max_features: 100}', 'trackink/max_features'),
                            ('tf_patiens: 3', 'tf_patiens')):
            parameters = os.path.join(self.folder, 'parameters.yaml')
            with open(parameters, 'w') as file:
                file.write('frontend: {%s}\n' % wrong)
            done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=' + sensor,
                                   'params:=' + parameters], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  timeout=60)
            self.assertIn("unknown option '" + name + "'", done.stdout)

    def test_04_a_map_that_is_not_there_ends_the_launch(self):
        sensor = os.path.join(self.data, 'smoke_sensor.yaml')
        done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'vip_slam.launch', 'sensor:=' + sensor,
                               'map:=/nowhere/map.vsm'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=60)
        self.assertIn('/nowhere/map.vsm', done.stdout)

    def test_05_run_bag_names_what_is_missing(self):
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
        # Depth of another size or rate than colour, and images of an unknown encoding, are named with what to do.
        for name, change, expected in (('size', halve_depth, '320x240'), ('rate', thin_depth, 'have no depth'),
                                       ('encoding', spoil_encoding, "'foo8'")):
            changed = os.path.join(self.folder, name + '.bag')
            copy_bag(bag, changed, 3.0, change)
            code, words = self.run_bag(changed, sensor, '--no-report')
            self.assertIn(expected, words, name)
        self.assertIn('no image has a pose', words)
        self.assertNotEqual(code, 0)
        code, words = self.run_bag(bag, sensor, '--set', 'frontend/tracking/max_featurez=3')
        self.assertNotEqual(code, 0)
        self.assertIn('max_featurez', words)

    def test_06_a_camera_that_stops_is_named(self):
        changed = os.path.join(self.folder, 'stops.bag')
        copy_bag(os.path.join(self.data, 'smoke.bag'), changed, 9.0,
                 lambda topic, message, number: None if 'image_raw' in topic and number > 60 else message)
        status = Listener('/vip_slam/tracking_status', TrackingStatus)
        launch = subprocess.Popen(['roslaunch', 'vip_slam_bringup', 'bag.launch', 'bag:=' + changed, 'sensor:=' +
                                   os.path.join(self.data, 'smoke_sensor.yaml'), 'rviz:=false'],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: any(s.state == TrackingStatus.TRACKING for s in status.all()), 40, 'tracking')
            wait_for(lambda: 'color/image_raw: silent' in status.last().reason, 30, 'a status that names the camera')
            self.assertEqual(status.last().state, TrackingStatus.WAITING)
        finally:
            launch.terminate()
            launch.wait(30)

    def test_06b_rivals_and_moving_parts_are_named(self):
        # A second camera under the same name, another odometry, and a tf that turns the IMU after it was read.
        bag = os.path.join(self.data, 'smoke.bag')
        images, diagnostics = [], Listener('/diagnostics', DiagnosticArray)
        with rosbag.Bag(bag) as recorded:
            fixed = next(m for _, m, _ in recorded.read_messages(topics=['/tf_static']))
            images = [m for _, (_, m, _) in zip(range(30), recorded.read_messages(topics=['/camera/color/image_raw']))]
            imu = next(m for _, m, _ in recorded.read_messages(topics=['/camera/imu'])).header.frame_id
        frames = Listener('/vip_slam/odom', Odometry)
        launch = subprocess.Popen(['roslaunch', 'vip_slam_bringup', 'bag.launch', 'sensor:=' +
                                   os.path.join(self.data, 'smoke_sensor.yaml'), 'rviz:=false', 'bag:=' + bag,
                                   'loop_playback:=true'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        def said(*words):
            return any(all(w in s.message for w in words) for m in diagnostics.all() for s in m.status)
        camera = rospy.Publisher('/camera/color/image_raw', Image, queue_size=5)
        tf = rospy.Publisher('/tf', TFMessage, queue_size=5)
        tf_static = rospy.Publisher('/tf_static', TFMessage, queue_size=5)
        turned = [t for t in fixed.transforms if t.child_frame_id == imu]
        self.assertTrue(turned, 'the IMU is in tf')
        turned[0].transform.rotation.x += 0.3
        norm = np.sqrt(sum(getattr(turned[0].transform.rotation, k) ** 2 for k in 'xyzw'))
        for k in 'xyzw':
            setattr(turned[0].transform.rotation, k, getattr(turned[0].transform.rotation, k) / norm)
        other = TransformStamped()
        other.header.frame_id, other.child_frame_id, other.transform.rotation.w = 'odom', 'base_link', 1
        try:
            frames.wait(20, 40, 'odometry')
            me = rospy.get_name()
            end = time.time() + 40
            while time.time() < end:
                image = images[int(10 * time.time()) % len(images)]
                image.header.frame_id = 'back_camera'
                camera.publish(image)
                tf.publish(TFMessage([other]))
                tf_static.publish(TFMessage(turned[:1]))
                time.sleep(0.1)
                if (said("frame_id 'back_camera' instead of") and said('published by 2 nodes', me) and
                        said(me + " publishes 'odom' -> 'base_link' too") and said('tf has moved')):
                    break
            self.assertTrue(said('color/image_raw', "frame_id 'back_camera' instead of"))
            self.assertTrue(said('color/image_raw', 'published by 2 nodes', me))
            self.assertTrue(said(me + " publishes 'odom' -> 'base_link' too"))
            self.assertTrue(said('tf has moved', 'since it was read'))
        finally:
            for publisher in (camera, tf, tf_static):
                publisher.unregister()
            launch.terminate()
            launch.wait(30)

    def test_06c_exit_at_end_waits_for_what_was_played(self):
        frames = Listener('/vip_slam/tracked_frame', TrackedFrame)
        subprocess.run(['roslaunch', 'vip_slam_bringup', 'bag.launch', 'sensor:=' +
                        os.path.join(self.data, 'smoke_sensor.yaml'), 'rviz:=false', 'exit_at_end:=true',
                        'bag:=' + os.path.join(self.data, 'smoke.bag')], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, timeout=120)
        with rosbag.Bag(os.path.join(self.data, 'smoke.bag')) as recorded:
            stamps = [m.header.stamp.to_sec() for _, m, _ in recorded.read_messages(topics=['/camera/color/image_raw'])]
        # The last image waits for the IMU samples that the bag does not have.
        self.assertGreaterEqual(frames.last().header.stamp.to_sec(), stamps[-3])

    def test_07_a_bag_that_is_not_there_ends_the_launch(self):
        for more in ('exit_at_end:=false', 'exit_at_end:=true'):
            done = subprocess.run(['roslaunch', 'vip_slam_bringup', 'bag.launch', 'bag:=/nowhere/none.bag', 'sensor:=' +
                                   os.path.join(self.data, 'smoke_sensor.yaml'), 'rviz:=false', more],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)
            self.assertIn('/nowhere/none.bag', done.stdout)
            self.assertNotIn('Traceback', done.stdout)

    def test_08_a_forgotten_argument_is_named(self):
        for launch, given, name in (('vip_slam', [], 'sensor'), ('bag', ['sensor:=d435i'], 'bag'),
                                    ('offline', ['sensor:=d435i', 'bag:=a.bag'], 'out')):
            command = ['roslaunch', 'vip_slam_bringup', launch + '.launch']
            done = subprocess.run(command + given, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  timeout=60)
            self.assertIn("requires the '%s' arg to be set" % name, done.stdout)
            done = subprocess.run(command + ['--ros-args'], stdout=subprocess.PIPE, text=True, timeout=60)
            self.assertRegex(done.stdout, 'Required Arguments:(.|\n)*  sensor: ')

    def test_09_files_are_named_as_the_caller_sees_them(self):
        folder = os.path.join(self.folder, "the caller's own")
        os.mkdir(folder)

        def roslaunch(launch, *more):
            return subprocess.run(['roslaunch', 'vip_slam_bringup', launch, *more], stdout=subprocess.PIPE, text=True,
                                  cwd=folder, env={**os.environ, 'PWD': folder}, timeout=60).stdout
        for given, expected in (('a.yml', folder + '/a.yml'), ('./a', folder + '/./a'), ('/b/a.yaml', '/b/a.yaml'),
                                ('~/a.yaml', os.environ['HOME'] + '/a.yaml'), ('d435i', 'd435i')):
            words = roslaunch('vip_slam.launch', 'sensor:=' + given, '--dump-params')
            for nodelet in ('frontend', 'backend', 'planes'):
                self.assertEqual(yaml.safe_load(words)['/vip_slam/%s/sensor' % nodelet], expected)
        words = roslaunch('offline.launch', 'sensor:=d435i', 'bag:=a.bag', 'out:=../out', '--args', '/run_bag')
        self.assertIn(' %s/a.bag --sensor d435i --out %s/../out ' % (folder, folder), words)
        words = roslaunch('bag.launch', 'sensor:=d435i', 'bag:=a.bag', '--args', '/player')
        self.assertIn(' %s/a.bag ' % folder, words)

    def record_run(self, out, during):
        """Exit status and what it prints when `during` happens and then an interrupt."""
        command = ['rosrun', 'vip_slam_bringup', 'record_run', '--out', out, '--ns', '/fake', '--as-is']
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            during()
        finally:
            process.send_signal(signal.SIGINT)
            words, _ = process.communicate(timeout=30)
        return process.returncode, words

    def test_10_a_recording_replaces_another_as_a_whole_or_not_at_all(self):
        # A system of topics and services only. Of 20 images two have no answer and two more no pose, and of one the
        # pose comes before the image.
        rospy.set_param('/use_sim_time', True)
        rospy.set_param('/fake/frontend/sensor', self.sensor_with(r'"/camera/', '"/fake/camera/'))
        publish = {name: rospy.Publisher('/fake/' + name, kind, queue_size=100)
                   for name, kind in (('odom', Odometry), ('tracked_frame', TrackedFrame),
                                      ('camera/color/image_raw', Image), ('camera/color/camera_info', CameraInfo))}

        def send(name, stamp):
            message = publish[name].data_class()
            message.header.stamp = rospy.Time.from_sec(stamp)
            publish[name].publish(message)

        def run():
            wait_for(lambda: all(p.get_num_connections() for p in publish.values()), 20, 'the recorder')
            for k in range(20):
                answers = [(name, 100 + 0.05 * k) for name in ('tracked_frame', 'odom')]
                images = [(name, 100 + 0.05 * k) for name in ('camera/color/camera_info', 'camera/color/image_raw')]
                answers = answers[:0 if k in (7, 8) else 1 if k < 2 else 2]
                for first_or_second in (answers, images) if k == 12 else (images, answers):
                    for name, stamp in first_or_second:
                        send(name, stamp)
                    time.sleep(0.1)

        def save(request):
            with open(request.path, 'w') as file:
                file.write('new\n')
            return True, 'written'
        services = [rospy.Service('/fake/save_trajectory', SaveTrajectory, save),
                    rospy.Service('/fake/save_map', SaveMap, save)]
        out = os.path.join(self.folder, 'recording')
        os.mkdir(out)
        earlier = ['odometry.tum', 'report.html', 'trajectory.tum']
        for name in earlier:
            with open(os.path.join(out, name), 'w') as file:
                file.write('earlier\n')

        def texts():
            return {name: open(os.path.join(out, name)).read() for name in sorted(os.listdir(out))}
        code, words = self.record_run(out, lambda: wait_for(lambda: publish['odom'].get_num_connections(), 20, 'it'))
        self.assertEqual((code, texts()), (1, {name: 'earlier\n' for name in earlier}), words)

        code, words = self.record_run(out, run)
        self.assertEqual(code, 0, words)
        self.assertIn('20 images sent, 2 of them without an answer, 16 with a pose', words)
        self.assertIn('1 of 16 not measurable', words)
        self.assertEqual(sorted(texts()), ['map.vsm', 'odometry.tum', 'planes.yaml', 'realtime.tum', 'summary.yaml',
                                           'timing.csv', 'trajectory.tum'])
        self.assertEqual(texts()['trajectory.tum'], 'new\n')
        summary = yaml.safe_load(texts()['summary.yaml'])
        self.assertEqual((summary['images'], summary['tracked_images']), (20, 16))
        self.assertEqual(summary['counters']['images_lost'], 2)
        self.assertAlmostEqual(summary['duration'], 0.95, 3)
        latencies = [float(row['ms']) for row in csv.DictReader(texts()['timing.csv'].splitlines())
                     if row['stage'] == 'live.latency']
        self.assertEqual(len(latencies), 15)
        self.assertGreaterEqual(min(latencies), 0)
        for service in services:
            service.shutdown()

        blocked = os.path.join(self.folder, 'a file')
        open(blocked, 'w').close()
        done = subprocess.run(['rosrun', 'vip_slam_bringup', 'record_run', '--out', blocked], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout),
                         (1, 'record_run: %s: a file, expected a folder\n' % blocked))


if __name__ == '__main__':
    rostest.rosrun('vip_slam_bringup', 'bad_input_test', BadInputTest)
