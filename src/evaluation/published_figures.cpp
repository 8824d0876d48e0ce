#include "evaluation/published_figures.hpp"

#include <algorithm>
#include <cctype>

namespace ipl_slam {
namespace {

// Of Table 2, which has the RMSE only.
PublishedAte rmse(const char* system, double value) {
  return {system, value, std::nullopt, std::nullopt, std::nullopt};
}

// "freiburg3" and "fr3", "sitting" and "s": one spelling for all.
std::string normalised(std::string_view folder_name) {
  std::string name(folder_name);
  for (char& c : name) c = c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name.starts_with("rgbd_dataset_")) name.erase(0, 13);
  for (const auto& [word, wanted] :
       {std::pair("freiburg3_", "fr3/"), std::pair("fr3_", "fr3/"), std::pair("fr3/w_", "fr3/walking_"),
        std::pair("fr3/s_", "fr3/sitting_")}) {
    if (name.starts_with(word)) name.replace(0, std::string_view(word).size(), wanted);
  }
  if (name.ends_with("_half")) name += "sphere";
  return name;
}

}  // namespace

const std::vector<PublishedSequence>& published_sequences() {
  static const std::vector<PublishedSequence> sequences = {
      {"fr3/walking_xyz",
       {rmse("ORB-SLAM2", 0.5359),
        {"DS-SLAM", 0.0288, 0.0206, 0.0166, 0.0201},
        rmse("DynaSLAM", 0.0158),
        rmse("CFP-SLAM", 0.0141),
        rmse("YOLO-SLAM", 0.0194),
        rmse("PLD-SLAM", 0.0144),
        rmse("DPL-SLAM", 0.0627),
        {"IPL-SLAM", 0.0129, 0.0112, 0.0105, 0.0068}},
       {{0.012976, 0.012945, 0.012923, 0.012909}},
       {{"DS-SLAM", 15.65, 75.25}, {"IPL-SLAM", 56.35, 125.18}}},
      {"fr3/walking_rpy",
       {rmse("ORB-SLAM2", 0.7408),
        {"DS-SLAM", 0.4752, 0.4051, 0.2856, 0.2484},
        rmse("DynaSLAM", 0.0402),
        rmse("CFP-SLAM", 0.0368),
        rmse("YOLO-SLAM", 0.0933),
        rmse("PLD-SLAM", 0.2212),
        rmse("DPL-SLAM", 0.0310),
        {"IPL-SLAM", 0.0827, 0.0592, 0.0526, 0.0415}},
       {{0.082932, 0.082801, 0.082795, 0.082748}},
       {}},
      {"fr3/walking_halfsphere",
       {rmse("ORB-SLAM2", 0.3962),
        {"DS-SLAM", 0.0283, 0.0242, 0.0209, 0.0147},
        rmse("DynaSLAM", 0.0274),
        rmse("CFP-SLAM", 0.0237),
        rmse("YOLO-SLAM", 0.0268),
        rmse("PLD-SLAM", 0.0261),
        rmse("DPL-SLAM", 0.0242),
        {"IPL-SLAM", 0.0315, 0.0269, 0.0226, 0.0164}},
       {{0.031625, 0.031523, 0.031567, 0.031549}},
       {}},
      {"fr3/walking_static",
       {rmse("ORB-SLAM2", 0.3540),
        {"DS-SLAM", 0.0076, 0.0069, 0.0063, 0.0036},
        rmse("DynaSLAM", 0.0080),
        rmse("CFP-SLAM", 0.0066),
        rmse("YOLO-SLAM", 0.0094),
        rmse("PLD-SLAM", 0.0065),
        rmse("DPL-SLAM", 0.0068),
        {"IPL-SLAM", 0.0113, 0.0104, 0.0098, 0.0043}},
       {{0.011356, 0.011332, 0.011341, 0.011324}},
       {}},
      {"fr3/sitting_rpy",
       {{"DS-SLAM", 0.0213, 0.0155, 0.0118, 0.0146}, {"IPL-SLAM", 0.0198, 0.0149, 0.0109, 0.0122}},
       std::nullopt,
       {}},
  };
  return sequences;
}

const std::vector<std::string>& published_systems() {
  static const std::vector<std::string> systems = [] {
    std::vector<std::string> names;
    for (const PublishedAte& ate : published_sequences().front().ate) names.push_back(ate.system);
    return names;
  }();
  return systems;
}

const std::array<std::string, 4>& ablation_titles() {
  static const std::array<std::string, 4> titles = {"segmentation only", "+ lines", "+ motion consistency",
                                                    "+ lines + adaptive weights"};
  return titles;
}

const PublishedSequence* find_published(std::string_view folder_name) {
  const std::string name = normalised(folder_name);
  const auto& all = published_sequences();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const PublishedSequence& s) { return s.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::optional<double> best_published(const PublishedSequence& sequence,
                                     std::optional<double> (*figure)(const PublishedAte&)) {
  std::optional<double> best;
  for (const PublishedAte& ate : sequence.ate) {
    if (const std::optional<double> value = figure(ate); value && (!best || *value < *best)) best = value;
  }
  return best;
}

}  // namespace ipl_slam
