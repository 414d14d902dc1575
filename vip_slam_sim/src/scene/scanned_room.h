// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// Whether a scene's name is that of such a file.
bool isScanFile(const std::string& name);

/// A room scanned by a headset: a triangle mesh, and labelled rectangles (floor, ceiling, walls, tables, windows,
/// doors, pictures) with pose and bounds, in one JSON file as @iwer/sem has them (y up). What is rendered is the mesh;
/// the true planes are floor, ceiling, walls and tables, fitted to it. The scan has no colours: surfaces get the
/// simulator's textures, windows, doors and pictures lie on their walls, and lamps hang under the ceiling. World: z up,
/// floor z = 0, origin and heading as in the file (x right, y = -z of the file). Throws std::runtime_error "file: what,
/// expected what".
Scene buildScannedRoom(const std::string& path);

}  // namespace vip_slam
