#pragma once

// How settings are declared. Each stage has a plain struct with a default for every field and one visit() that names
// the fields; printing, reading, range checks and documentation all go through it, so no key can be forgotten:
//
//   struct OrbOptions {
//     int features = 1000;
//     bool blur = true;
//     std::string detector = "fast";
//     template <class Visitor>
//     void visit(Visitor& v) {
//       v.number("features", features, {.min = 50, .max = 10000, .unit = "count", .doc = "keypoints kept per frame"});
//       v.flag("blur", blur, "smooth the image before descriptors are taken");
//       v.choice("detector", detector, {"fast", "agast"}, "corner detector");
//       v.section("grid", grid, "grid that spreads the keypoints");   // a nested options struct
//     }
//   };

namespace ipl_slam {

/// Limits and documentation of a numeric setting; min and max are allowed values.
struct NumberInfo {
  double min;
  double max;
  const char* unit;
  const char* doc;
};

}  // namespace ipl_slam
