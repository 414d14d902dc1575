// SPDX-License-Identifier: BSD-3-Clause
// train_vocabulary INPUT... --out FILE: a place-recognition vocabulary from bags and pictures, with the same corners
// and descriptors as in the front end.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vip_slam_backend/place_recognition/vocabulary_io.h"
#include "vip_slam_backend/place_recognition/vocabulary_trainer.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_core/util/progress_bar.h"
#include "vip_slam_frontend/tracking/corner_detector.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"
#include "vip_slam_ros/bag_files.h"
#include "vip_slam_ros/image_decoding.h"

namespace {

using vip_slam::Descriptor;
using Images = std::vector<std::vector<Descriptor>>;

class Describer {
 public:
  explicit Describer(int corners) : orb_(corners) {}
  /// Tracked corners and further ORB corners, as in a keyframe.
  std::vector<Descriptor> operator()(const cv::Mat& gray) const {
    std::vector<vip_slam::Feature> features;
    for (const vip_slam::Corner& corner : vip_slam::detectCorners(gray, {}, tracking_.max_features, tracking_)) {
      vip_slam::Feature feature;
      feature.pixel = Eigen::Vector2f(corner.pixel.x, corner.pixel.y);
      features.push_back(feature);
    }
    orb_.describe(gray, &features);
    std::vector<cv::Point2f> occupied;
    for (const auto& f : features) occupied.emplace_back(f.pixel.x(), f.pixel.y());
    for (const auto& f : orb_.extract(gray, occupied, 6.0)) features.push_back(f);
    std::vector<Descriptor> descriptors;
    for (const auto& f : features) descriptors.push_back(f.descriptor);
    return descriptors;
  }

 private:
  vip_slam::OrbExtractor orb_;
  vip_slam::TrackingOptions tracking_;
};

bool isDepth(const sensor_msgs::Image& image) {
  return image.encoding == "16UC1" || image.encoding == "32FC1" || image.encoding == "mono16";
}

/// The message's image in grey; empty when it is none, or depth.
cv::Mat colourOf(const rosbag::MessageInstance& message) {
  if (const auto image = message.instantiate<sensor_msgs::Image>())
    return isDepth(*image) ? cv::Mat() : vip_slam::decodeGray(*image, image);
  const auto compressed = message.instantiate<sensor_msgs::CompressedImage>();
  if (!compressed || compressed->format.find("16UC1") != std::string::npos ||
      compressed->format.find("Depth") != std::string::npos)
    return {};
  return vip_slam::decodeGray(*compressed);
}

/// Uses the images of the colour topics that are at least `every` seconds after the one used before.
void describeBag(const std::string& path, double every, const Describer& describe, Images* images) {
  rosbag::Bag bag;
  vip_slam::openBag(path, &bag);
  std::map<std::string, double> last;
  for (const auto& message : rosbag::View(bag)) {
    const double t = message.getTime().toSec();
    const auto before = last.find(message.getTopic());
    if (before != last.end() && t - before->second < every) continue;
    cv::Mat gray;
    try {
      gray = colourOf(message);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(path + ": topic " + message.getTopic() + vip_slam::formatted(" at %.3f s: ", t) +
                               error.what());
    }
    if (gray.empty()) continue;
    last[message.getTopic()] = t;
    images->push_back(describe(gray));
  }
}

void describeInput(const std::string& input, double every, const Describer& describe, Images* images) {
  namespace fs = std::filesystem;
  if (fs::is_directory(input)) {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(input))
      if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const std::string& file : files) {
      const cv::Mat gray = cv::imread(file, cv::IMREAD_GRAYSCALE);
      if (!gray.empty()) images->push_back(describe(gray));
    }
  } else if (fs::path(input).extension() == ".bag") {
    describeBag(input, every, describe, images);
  } else {
    const cv::Mat gray = cv::imread(input, cv::IMREAD_GRAYSCALE);
    if (gray.empty())
      throw std::runtime_error(input + ": cannot be read, expected a bag, a picture or a folder of pictures");
    images->push_back(describe(gray));
  }
}

int train(const std::vector<std::string>& inputs, const std::string& out, double every, int corners,
          const vip_slam::VocabularyTrainerOptions& options) {
  const Describer describe(corners);
  Images images;
  vip_slam::ProgressBar reading("reading");
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    reading.update(static_cast<double>(k) / inputs.size(), inputs[k]);
    describeInput(inputs[k], every, describe, &images);
  }
  std::size_t descriptors = 0;
  for (const auto& image : images) descriptors += image.size();
  reading.finish(std::to_string(images.size()) + " images, " + std::to_string(descriptors) + " descriptors");
  vip_slam::ProgressBar training("training");
  const vip_slam::Vocabulary vocabulary =
      vip_slam::trainVocabulary(images, options, [&training](double done) { training.update(done, ""); });
  vip_slam::saveVocabulary(vocabulary, out);
  training.finish(std::to_string(vocabulary.words()) + " words in " + out + ", " +
                  std::to_string(std::filesystem::file_size(out) / 1024) + " KiB");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("train_vocabulary",
                             "Trains a place-recognition vocabulary from bags, pictures and folders of pictures.");
  std::vector<std::string> inputs;
  std::string out;
  double every = 0.5;
  int corners = 400;
  vip_slam::VocabularyTrainerOptions options;
  line.argument("inputs", inputs, "bags, pictures, folders of pictures");
  line.option("out", out, "vocabulary file to write");
  line.required("out");
  line.option("every", every, "seconds between pictures taken from a bag; 0: every picture",
              vip_slam::between(0.0, 1e6));
  line.option("corners", corners, "ORB corners per picture beside the tracked ones", vip_slam::between(0, 100000));
  line.option("branching", options.branching, "children per node", vip_slam::between(2, 255));
  line.option("levels", options.levels, "levels of the tree", vip_slam::between(1, 10));
  line.option("min-descriptors", options.min_descriptors, "nodes with fewer descriptors are not split",
              vip_slam::between(1, 1 << 30));
  line.option("seed", options.seed, "of the random choice of first centres");
  if (const auto status = line.parse(argc, argv)) return *status;
  cv::setNumThreads(1);
  try {
    const std::string folder = std::filesystem::path(out).parent_path().string();
    vip_slam::prepareOutputFolder(folder.empty() ? "." : folder);
    return train(inputs, out, every, corners, options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "train_vocabulary: %s\n", error.what());
    return 1;
  }
}
