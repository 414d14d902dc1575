# SPDX-License-Identifier: BSD-3-Clause
"""The faults: what a user's recording has, what has to be said of it, and how far off the poses may be.

A fault is a function of the recording. It returns how messages change, and optionally the sensor file that a user would
have with it (`sensor`) and the true times of stamps (`restored`).
"""
import numpy as np

from faults.lens import RADIAL, Lens
from faults.recording import inertial, pixels, restamped, stamp, with_inertial, with_pixels

FAULTS = []
TURNED = np.array([[0., 0, 1], [1, 0, 0], [0, 1, 0]])  # axes changed over, right-handed


class Fault:
    """One fault and what is expected of it.

    says: what check_bag or run_bag has to say, a regular expression; empty: nothing but that all is well
    ready: whether check_bag has to call the recording ready; None: either, with a warning
    odometry, trajectory: largest RMSE of the positions, cm; None: there need be no pose
    """

    def __init__(self, make, says, ready, odometry, trajectory):
        self.make, self.says, self.ready = make, says, ready
        self.odometry, self.trajectory = odometry, trajectory
        self.name, self.title = make.__name__, make.__doc__


def fault(says, ready, odometry=None, trajectory=None):
    return lambda make: FAULTS.append(Fault(make, says, ready, odometry, trajectory)) or make


class Made:
    def __init__(self, change, sensor=None, restored=None):
        self.change, self.sensor = change, sensor
        self.restored = restored or (lambda times: times)


def keep(topic, message):
    return [(topic, message)]


def of_images(topics, alter):
    """Alters the images of some topics."""
    return lambda topic, message: [(topic, alter(message) if topic in topics else message)]


def of_imu(r, alter):
    """Alters specific force and rate: alter(force, rate, seconds since the beginning)."""
    def change(topic, message):
        if topic != r.imu:
            return [(topic, message)]
        return [(topic, with_inertial(message, *alter(*inertial(message), stamp(message) - r.begin)))]
    return change


def from_camera_info(r):
    return r.with_sensor(intrinsics_from_camera_info=True)


# ---- clocks ----

def clock_set(r, seconds):
    """All streams step together in the middle."""
    def change(topic, message):
        return [(topic, restamped(message, seconds) if stamp(message) > r.middle else message)]

    def restored(times):
        behind = np.concatenate([[False], np.maximum.accumulate(np.diff(times) < 0)])
        stepped = behind | (times > r.middle + 1e-3) if seconds < 0 else times > r.middle + 1e-3
        return np.where(stepped, times - seconds, times)
    return Made(change, restored=restored)


@fault('', True, 0.3, 0.15)
def no_fault(r):
    """none"""
    return Made(keep)


@fault('set back by 0.900 s', None, 0.5, 0.5)
def clock_back(r):
    """the machine's clock is set back by 0.9 s"""
    return clock_set(r, -0.9)


@fault('set back by 0.050 s', None, 0.5, 0.5)
def clock_back_a_little(r):
    """the machine's clock is set back by 0.05 s"""
    return clock_set(r, -0.05)


@fault('set forward by 0.09', None, 0.5, 0.5)
def clock_forward(r):
    """the machine's clock is set forward by 0.09 s"""
    return clock_set(r, 0.09)


@fault('/imu: its clock was set back by 0.300 s .* alone', None, 0.5, 0.5)
def clock_of_the_imu(r):
    """the IMU's clock alone is set back by 0.3 s"""
    return Made(lambda topic, message: [
        (topic, restamped(message, -0.3) if topic == r.imu and stamp(message) > r.middle else message)])


@fault('ahead of those around', None, 0.5, 0.5)
def stamps_from_the_future(r):
    """one image in forty is stamped 0.5 s ahead"""
    counted = dict.fromkeys(r.of_camera, 0)

    def change(topic, message):
        if topic not in counted:
            return [(topic, message)]
        counted[topic] += 1
        return [(topic, restamped(message, 0.5) if counted[topic] % 40 == 0 else message)]
    return Made(change)


@fault('IMU: all stamps are the same', False)
def imu_without_stamps(r):
    """the IMU is never stamped"""
    return Made(lambda topic, message: [(topic, restamped(message, -1e12) if topic == r.imu else message)])


# ---- streams ----

@fault("have frame_id 'rear_camera_optical_frame' instead of", None, 0.3, 0.15)
def second_camera(r):
    """a second camera publishes on the same topics from the middle on"""
    def change(topic, message):
        if topic not in r.of_camera or stamp(message) < r.middle:
            return [(topic, message)]
        other = restamped(message, 0.02)
        if topic in r.images:
            other = with_pixels(other, pixels(other)[::-1, ::-1])
        other.header.frame_id = 'rear_camera_optical_frame'
        return [(topic, message), (topic, other)]
    return Made(change)


@fault('', None, 0.3, 0.15)
def first_camera_info_empty(r):
    """the first camera_info are empty"""
    left = dict.fromkeys(r.infos, 8)

    def change(topic, message):
        if left.get(topic, 0) > 0:
            left[topic] -= 1
            message.K = message.P = message.R = ()
            message.K, message.P, message.R, message.D = (0.0,) * 9, (0.0,) * 12, (0.0,) * 9, ()
        return [(topic, message)]
    return Made(change, from_camera_info(r))


@fault('the largest hole is 0.40 s', None, 1.0, 0.5)
def imu_hole(r):
    """the IMU is missing for 0.4 s"""
    return Made(lambda topic, message: [] if topic == r.imu and 0 < stamp(message) - r.middle < 0.4
                else [(topic, message)])


# ---- cameras ----

@fault('folds', False)
def folding_distortion(r):
    """coefficients of another model, by which the image folds over"""
    def change(topic, message):
        if topic in r.infos:
            message.distortion_model, message.D = 'plumb_bob', (-1.5, 0.4, 0.0, 0.0, 0.0)
        return [(topic, message)]
    return Made(change, from_camera_info(r))


@fault('K is zero, P is used instead', None, 0.3, 0.15)
def only_p_filled(r):
    """K is zero, P is filled"""
    def change(topic, message):
        if topic in r.infos:
            message.K = (0.0,) * 9
        return [(topic, message)]
    return Made(change, from_camera_info(r))


@fault('camera_info holds', False)
def lens_not_in_the_sensor_file(r):
    """camera_info has the lens, the sensor file that is used has none"""
    lens = Lens(r.sensor['camera'])

    def change(topic, message):
        if topic in r.infos:
            message.distortion_model, message.D = 'plumb_bob', (*RADIAL, 0.0, 0.0, 0.0)
        if topic == r.color:
            message = with_pixels(message, lens.colour(pixels(message)))
        if topic == r.depth:
            message = with_pixels(message, lens.depth(pixels(message)))
        return [(topic, message)]
    return Made(change, r.with_sensor(intrinsics_from_camera_info=False))


@fault('mirrored', False)
def mirrored(r):
    """the driver mirrors its pictures"""
    return Made(of_images(r.images, lambda m: with_pixels(m, pixels(m)[:, ::-1])))


@fault('extrinsics|upside', False)
def upside_down(r):
    """the camera is built in upside down, the extrinsics do not say so"""
    return Made(of_images(r.images, lambda m: with_pixels(m, pixels(m)[::-1, ::-1])))


@fault('colour and depth: do not fit from', False)
def torn(r):
    """from the middle on the colour image is torn: its columns wrapped round by 100"""
    return Made(of_images((r.color,), lambda m: with_pixels(m, np.roll(pixels(m), 100, 1))
                          if stamp(m) > r.middle else m))


@fault('16 bits|fill', None, 0.3, 0.15)
def ten_bits_of_sixteen(r):
    """grey in 16 bits, of which the sensor fills 10"""
    def alter(message):
        return with_pixels(message, (pixels(message).mean(2) * 4).astype(np.uint16), 'mono16')
    return Made(of_images((r.color,), alter), r.with_sensor(color={'encoding': 'mono16'}))


# ---- depth ----

@fault('depth/scale: 0.0008', False)
def depth_in_other_units(r):
    """depth in 0.8 mm read as mm"""
    return Made(of_images((r.depth,), lambda m: with_pixels(m, (pixels(m) / 0.8).astype(np.uint16))))


@fault('set anew', None, 1.0, 0.3)
def depth_unit_changes(r):
    """the unit of depth changes from 1 to 0.5 mm on the way"""
    return Made(of_images((r.depth,), lambda m: with_pixels(m, pixels(m) * 2) if stamp(m) > r.middle else m))


def without_reading(r, value):
    random = np.random.default_rng(1)

    def alter(message):
        depth = pixels(message)
        lost = (depth > 5000) | (random.random(depth.shape) < 0.05)
        return with_pixels(message, np.where(lost, value, depth).astype(np.uint16))
    return Made(of_images((r.depth,), alter))


@fault('no reading|reading', None, 0.5, 0.3)
def no_reading_is_4m(r):
    """"no reading" is written as 4.000 m"""
    return without_reading(r, 4000)


@fault('', None, 0.5, 0.3)
def no_reading_is_the_largest(r):
    """"no reading" is written as 65535"""
    return without_reading(r, 65535)


@fault('depth shows an earlier moment than its stamps say', None, 2.0, 2.0)
def depth_lags(r):
    """the driver's temporal filter: depth lags behind the motion"""
    kept = []

    def alter(message):
        depth = pixels(message).astype(float)
        smooth = depth if not kept else np.where((depth > 0) & (kept[0] > 0), 0.4 * depth + 0.6 * kept[0], depth)
        kept[:] = [smooth]
        return with_pixels(message, smooth.astype(np.uint16))
    return Made(of_images((r.depth,), alter))


@fault('mono8|grey', None, 4.0, 1.0)
def depth_in_eight_bits(r):
    """depth as 8-bit grey"""
    return Made(of_images((r.depth,), lambda m: with_pixels(m, (pixels(m) / 10000 * 255).astype(np.uint8), 'mono8')))


@fault('is_bigendian', False, 4.0, 1.0)
def swapped_bytes(r):
    """the two bytes of depth are changed over"""
    return Made(of_images((r.depth,), lambda m: with_pixels(m, pixels(m).byteswap())))


@fault('', None, 0.5, 0.3)
def holes_filled_from_the_left(r):
    """the driver fills the shadows of depth from the left"""
    def alter(message):
        depth = pixels(message).copy()
        rows, columns = np.nonzero(np.diff(depth.astype(int), axis=1) > 200)
        for k in range(1, 7):
            inside = columns + k < depth.shape[1]
            depth[rows[inside], columns[inside] + k] = depth[rows[inside], columns[inside]]
        return with_pixels(message, depth)
    return Made(of_images((r.depth,), alter))


# ---- IMU ----

@fault('of the accelerometer are', False)
def accelerometer_in_other_axes(r):
    """accelerometer and gyroscope in different axes: the accelerometer is wrong"""
    return Made(of_imu(r, lambda a, w, t: (TURNED @ a, w)))


@fault('of the accelerometer are', False)
def gyroscope_in_other_axes(r):
    """accelerometer and gyroscope in different axes: the gyroscope is wrong"""
    return Made(of_imu(r, lambda a, w, t: (a, TURNED @ w)))


@fault('IMU', None, 1.0, 0.5)
def gyroscope_in_degrees(r):
    """the gyroscope is in degrees from the middle on"""
    return Made(of_imu(r, lambda a, w, t: (a, np.degrees(w) if t > r.middle - r.begin else w)))


@fault('gravity', False, 6.0, 4.0)
def gravity_taken_out(r):
    """the driver takes gravity out"""
    def alter(force, rate, seconds):
        up = r.true_rotations([r.begin + seconds])[0][2]
        return force - 9.81 * up, rate
    return Made(of_imu(r, alter))


@fault('smoothed', None, 3.0, 3.0)
def smoothed_imu(r):
    """the IMU is low-passed at 8 Hz"""
    state = []

    def alter(force, rate, seconds):
        values = np.concatenate([force, rate])
        share = 1 - np.exp(-2 * np.pi * 8 / r.sensor['imu']['rate'])
        state[:] = [state[0] + share * (values - state[0]) if state else values]
        return state[0][:3], state[0][3:]
    return Made(of_imu(r, alter))


@fault('gyro_correction', None, 0.5, 0.3)
def inexact_gyroscope(r):
    """the gyroscope measures 1 % too much, as its data sheet allows"""
    return Made(of_imu(r, lambda a, w, t: (a, 1.01 * w)), r.with_sensor(imu={'gyro_correction_sigma': 0.005}))


@fault('shock|shak|contradict', None, 1.0, 0.5)
def shaken_imu(r):
    """the IMU is shaken for 0.2 s, the images are not"""
    random = np.random.default_rng(2)

    def alter(force, rate, seconds):
        if not 0 < seconds - (r.middle - r.begin) < 0.2:
            return force, rate
        return force + 30 * random.standard_normal(3), rate + 3 * random.standard_normal(3)
    return Made(of_imu(r, alter))
