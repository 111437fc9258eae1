// What the simulators of this folder share: the scene that they are asked to dissect, and the way to the answer.
// Lengths are in m, times in s, masses in kg.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cutproof/plugin.h"

namespace cutproof::baselines {

using Vec3 = Eigen::Vector3d;

// What a blade sweeps on the way to a frame, where it lies at the frame's end: triangles 0 1 2 and 0 2 3.
using Patch = std::array<Vec3, 4>;

struct Scene {
  double spacing = 0;
  std::vector<Vec3> rest, velocity;           // [n] m, m/s
  std::vector<double> mass;                   // [n]
  std::vector<uint8_t> held;                  // [n] 1: stays where it is
  std::vector<std::array<int32_t, 3>> node;   // [n] of the grid
  std::vector<std::array<int32_t, 2>> edges;  // each once, the smaller end first
  std::vector<std::array<int32_t, 4>> tetrahedra;
  std::vector<std::array<int32_t, 8>> hexahedra;  // corners in VTK's order
  Vec3 gravity = Vec3::Zero();                    // m/s²
  double frame_time = 0;
  std::vector<std::vector<Patch>> blade;  // [frames]; the first frame is the start
  std::vector<Vec3> kick;                 // [n] m/s, added to velocities as the way to kick_frame begins
  int kick_frame = -1;                    // -1: never
};
Scene scene_of(const cutproof_scene& asked);

// Parameters of a plugin: "name=value,name=value".
class Parameters {
 public:
  // `known`: names with their defaults. Throws std::invalid_argument for others, and for values that are no finite
  // numbers; the text names the parameter and lists the known ones.
  Parameters(const char* text, std::map<std::string, double> known);
  double operator()(const std::string& name) const { return values_.at(name); }

 private:
  std::map<std::string, double> values_;
};

// A state between two frames. Empty: not given.
struct Frame {
  std::vector<Vec3> position, velocity, spin;  // [p] m, m/s, kg m²/s; the first n are the scene's particles
  std::vector<double> mass;                    // [p]
  std::vector<uint8_t> alive;                  // [p]
  std::vector<int32_t> parent;                 // [p] which particle one was split from; -1: none
  // What contacts and grips gave in the frame [kg m/s]. Of all frames, or of none.
  std::optional<Vec3> contact_impulse;
  // Coupling groups, or cells, which are groups as well. No value: as in the frame before.
  bool has_groups = false, has_cells = false;
  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> members;
  std::vector<double> weights;  // of each member, or none
  std::vector<std::array<int32_t, 4>> tetrahedra;
  std::vector<std::array<int32_t, 8>> hexahedra;
};

class Simulator {
 public:
  virtual ~Simulator() = default;
  virtual int substeps() const = 0;             // in a frame
  virtual double damping() const { return 0; }  // 1/s: velocities decay by this rate
  // Adds to the velocities: `kick` is [n] of the scene's particles. Nodes split from one may be of another piece, and
  // get none.
  virtual void kick(const std::vector<Vec3>& kick) = 0;
  // One frame of motion.
  virtual void advance(double frame_time) = 0;
  // Cuts along the patches; never called without any.
  virtual void cut(const std::vector<Patch>& patches) = 0;
  // Returns when all work is done; what advance() and cut() cost is timed to here.
  virtual void finish() {}
  // `changed`: whether groups and cells may be other ones than in the frame before.
  virtual Frame frame(bool changed) const = 0;
};

#ifdef BASELINES_HAVE_CUDA
void require_device();  // throws std::runtime_error where there is none
#endif

// Simulates the scene and answers. Returns 0, or 1 where memory does not suffice for the answer.
int dissect(Simulator& simulator, const Scene& scene, const cutproof_host* host, cutproof_frames* run);

// Whether the segment from a to b crosses the patch. A point in the plane counts as on its positive side, so that of
// two segments that meet there one crosses; borders belong to the patch.
bool crosses(const Patch& patch, const Vec3& a, const Vec3& b);

// A number for each of `count` things: equal where pairs join them, ascending with their first members.
std::vector<int32_t> components(int32_t count, const std::vector<std::array<int32_t, 2>>& pairs);

}  // namespace cutproof::baselines
