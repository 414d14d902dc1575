# SPDX-License-Identifier: BSD-3-Clause
"""Reads what run_bag left and reduces it to what the page shows."""
import csv
import math
import os

import numpy as np
import yaml

import metrics

MAX_PATH_POINTS = 4000
MAX_STAGE_POINTS = 1500


class Unreadable(Exception):
    """One line for the user: file, line, what is wrong."""


def read_tum(path):
    """Array of rows t, x, y, z, qx, qy, qz, qw; strictly increasing in t: of a time that comes twice, as where a clock
    was set back, the first."""
    rows, back, first_back = [], 0, 0
    try:
        with open(path, encoding='utf-8') as file:
            for number, line in enumerate(file, 1):
                text = line.split('#')[0].replace(',', ' ').split()
                if not text:
                    continue
                try:
                    values = [float(v) for v in text]
                except ValueError:
                    raise Unreadable('%s:%d: expected eight numbers' % (path, number))
                if len(values) != 8 or not all(math.isfinite(v) for v in values):
                    raise Unreadable('%s:%d: expected eight numbers' % (path, number))
                if rows and values[0] == rows[-1][0]:
                    continue
                if rows and values[0] < rows[-1][0]:
                    back, first_back = back + 1, first_back or number
                    continue
                rows.append(values)
    except UnicodeDecodeError:
        raise Unreadable('%s: is not a text file' % path)
    if back and back >= len(rows):
        raise Unreadable('%s:%d: the stamp does not follow the one before, and so most of them' % (path, first_back))
    return np.array(rows).reshape(-1, 8)


def read_yaml(path):
    try:
        with open(path, encoding='utf-8') as file:
            return yaml.load(file, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader)) or {}
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise Unreadable('%s: %s' % (path, ' '.join(str(error).split())))


def read_planes(path):
    data = read_yaml(path)
    planes = []
    if data and (not isinstance(data, dict) or not isinstance(data.get('planes'), list)):
        raise Unreadable('%s: planes: missing, expected a list' % path)
    for index, plane in enumerate(data['planes'] if data else []):
        try:
            planes.append({
                'id': int(plane['id']), 'kind': str(plane['kind']),
                'normal': [float(v) for v in plane['normal']], 'distance': float(plane['distance']),
                'area': float(plane.get('area', 0.0)), 'keyframes': plane.get('keyframes'),
                'seen_seconds': plane.get('seen_seconds'), 'seen_area': plane.get('seen_area'),
                'polygons': [{'outer': [[float(v) for v in p] for p in polygon['outer']],
                              'holes': [[[float(v) for v in p] for p in ring] for ring in polygon.get('holes') or []]}
                             for polygon in plane.get('polygons') or []]})
        except (KeyError, TypeError, ValueError) as error:
            raise Unreadable('%s: plane %d: %s is missing or unreadable' % (path, index + 1, error))
    return planes


def read_timing(path):
    stages = {}
    with open(path, encoding='utf-8', errors='replace', newline='') as file:
        for number, row in enumerate(csv.reader(file), 1):
            if number == 1 and row[:1] == ['stage'] or not row:
                continue
            try:
                # Live runs have no processor time.
                cpu = float(row[3]) if len(row) > 3 else float('nan')
                stages.setdefault(row[0], []).append((float(row[1]), float(row[2]), cpu))
            except (IndexError, ValueError):
                raise Unreadable('%s:%d: expected stage,t,ms[,cpu_ms]' % (path, number))
    return {name: np.array(rows) for name, rows in stages.items()}


def thinned(rows, limit):
    """At most `limit` rows, first and last kept."""
    if len(rows) <= limit:
        return rows
    return rows[np.unique(np.linspace(0, len(rows) - 1, limit).round().astype(int))]


def rounded(array, digits):
    return np.round(np.asarray(array, dtype=float), digits).tolist()


def path_points(poses, t0):
    """Lists t, x, y, z for the page; t from the start of the run."""
    if len(poses) == 0:
        return None
    rows = thinned(poses, MAX_PATH_POINTS)
    return {'t': rounded(rows[:, 0] - t0, 3), 'p': rounded(rows[:, 1:4], 3)}


def stage_summary(name, rows, t0):
    ms = rows[:, 1]
    # A picture of the spikes needs the largest of each bin, not every n-th.
    order = np.argsort(rows[:, 0], kind='stable')
    bins = np.array_split(order, min(MAX_STAGE_POINTS, len(order)))
    peaks = np.array([index[np.argmax(ms[index])] for index in bins])
    cpu = rows[:, 2][np.isfinite(rows[:, 2])]
    return {'name': name, 'count': int(len(ms)), 'mean': float(ms.mean()),
            'cpu_mean': float(cpu.mean()) if len(cpu) else None, 'median': float(np.median(ms)),
            'p99': float(np.percentile(ms, 99)), 'max': float(ms.max()), 'total': float(ms.sum() / 1000.0),
            't': rounded(rows[peaks, 0] - t0, 3), 'ms': rounded(ms[peaks], 3)}


def load(folder, truth_path=None, planes_truth_path=None, time_offset=0.0):
    if not os.path.isdir(folder):
        raise Unreadable('%s: is not a folder' % folder)
    for given in (truth_path, planes_truth_path):
        if given and not os.path.isfile(given):
            raise Unreadable('%s: is not there' % given)

    def present(name):
        path = os.path.join(folder, name)
        return path if os.path.isfile(path) else None

    if not present('trajectory.tum') and not present('odometry.tum'):
        raise Unreadable('%s: neither trajectory.tum nor odometry.tum; expected a folder that run_bag wrote' % folder)
    missing = [name for name in ('trajectory.tum', 'odometry.tum', 'planes.yaml', 'timing.csv', 'summary.yaml')
               if not present(name)]
    # A run of the front end alone has no trajectory in the map: the odometry takes its place.
    trajectory = read_tum(present('trajectory.tum') or present('odometry.tum'))
    summary = read_yaml(present('summary.yaml')) if present('summary.yaml') else {}
    if not isinstance(summary, dict):
        raise Unreadable('%s/summary.yaml: expected keys and values' % folder)
    t0 = float(trajectory[0, 0]) if len(trajectory) else 0.0
    states = summary.get('states') or []
    if states:
        t0 = min(t0, float(states[0].get('t', t0))) if len(trajectory) else float(states[0].get('t', 0.0))
    data = {'summary': summary, 't0': t0, 'missing': missing, 'trajectory': path_points(trajectory, t0)}
    data['t_end'] = float(trajectory[-1, 0] - t0) if len(trajectory) else 0.0
    if present('odometry.tum') and present('trajectory.tum'):
        data['odometry'] = path_points(read_tum(present('odometry.tum')), t0)
    data['planes'] = read_planes(present('planes.yaml')) if present('planes.yaml') else []
    stages = read_timing(present('timing.csv')) if present('timing.csv') else {}
    data['stages'] = [stage_summary(name, rows, t0) for name, rows in sorted(stages.items())]

    T_truth_map = None
    if truth_path:
        truth = read_tum(truth_path)
        result = metrics.trajectory_error(trajectory, truth, time_offset)
        if result is None:
            data['truth_note'] = 'The truth has no pose at the times of this run.'
        else:
            T_truth_map = result.pop('T_truth_map')
            keep = thinned(np.arange(len(result['t'])), MAX_PATH_POINTS)
            errors = {'t': rounded(result['t'][keep] - t0, 3), 'position': rounded(result['position'][keep], 5),
                      'rotation': rounded(result['rotation'][keep], 4)}
            data['error'] = dict(errors, ate=result['ate'], median=result['median'], max=result['max'],
                                 rotation_rmse=result['rotation_rmse'], count=result['count'],
                                 rotation_aligned_by=result['rotation_aligned_by'],
                                 images=len(trajectory))
            # The truth is shown in the run's own map frame.
            R, p = T_truth_map[:3, :3].T, T_truth_map[:3, 3]
            inside = truth[(truth[:, 0] >= trajectory[0, 0] - 0.1) & (truth[:, 0] <= trajectory[-1, 0] + 0.1)].copy()
            inside[:, 1:4] = (inside[:, 1:4] - p) @ R.T
            data['truth'] = path_points(inside, t0)
    if planes_truth_path:
        data['plane_report'] = metrics.plane_errors(data['planes'], read_planes(planes_truth_path), T_truth_map)
    return data
