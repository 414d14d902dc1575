# SPDX-License-Identifier: BSD-3-Clause
"""Topics of the sensor that a running front end was given."""
import os

import rospkg
import rospy
import yaml


def sensor_topics(ns):
    """`topics` of its sensor file; empty when that is not known. `ns`: namespace of the system."""
    try:
        sensor = rospy.get_param(ns + '/frontend/sensor')
        if not os.path.exists(sensor):
            folder = rospkg.RosPack().get_path('vip_slam_bringup')
            sensor = os.path.join(folder, 'config', 'sensors', sensor + '.yaml')
        with open(sensor, encoding='utf-8') as file:
            return dict(yaml.safe_load(file)['topics'])
    except (KeyError, OSError, TypeError, ValueError, rospkg.ResourceNotFound, yaml.YAMLError):
        return {}
