// Sixteen particles that one stroke cuts in two within a few frames.
#pragma once

namespace cutproof::tests {

inline constexpr const char* kCutScene = R"({"version": 5, "name": "cut",
  "body": {"shape": {"kind": "box", "size": [0.04, 0.02, 0.02]}, "spacing": 0.01},
  "frame": {"settle": 0.016}, "detect": {"criterion": "geometric"}, "ground": {"friction": 0.5},
  "blade": {"speed": 2, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]},
  "expect": {"components_at_end": 2, "shells_at_end": 2}})";

}  // namespace cutproof::tests
