# SPDX-License-Identifier: BSD-3-Clause
"""Puts data, style and scripts into one file."""
import html
import json
import math
import os

PARTS = ('charts.js', 'maps.js', 'report.js')


def finite(value):
    """JSON has no NaN: such numbers become null."""
    if isinstance(value, dict):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def render(data, folder):
    def part(name):
        with open(os.path.join(folder, name), encoding='utf-8') as file:
            return file.read()

    # "</" inside a string would end the script element.
    payload = json.dumps(finite(data), separators=(',', ':'), default=str, allow_nan=False).replace('</', '<\\/')
    name = os.path.basename(str(data['summary'].get('bag') or '')) or 'run'
    return (part('template.html')
            .replace('@TITLE@', html.escape(name))
            .replace('@STYLE@', part('report.css'))
            .replace('@SCRIPT@', '\n'.join(part(name) for name in PARTS))
            .replace('@DATA@', payload))
