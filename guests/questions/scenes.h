// Scenes for whole simulators: a body and blades. The question of `dissect`, and its answer as a run
// (docs/reference/plugins.md, Whole simulators).
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "guests/questions/question.h"
#include "model/io/array_file.h"
#include "model/vec.h"
#include "oracles/runs/run_judge.h"

namespace cutproof::guests::scenes {

// Limits of a plugin.
struct Limits {
  double particles = 60;
  double gap = 1;                                                // [h] between cuts side by side
  double cut_resolution = 0;                                     // [h]
  double one_blade = 0, cells = 0, diagonals = 0, no_grips = 0;  // 1: the word is given
};
// Limits from their words. Throws InputError for an unknown word.
Limits limits_of(const std::string& words, const std::string& plugin);

// A plugin's promises of its runs and of related runs. Their bits are in a question.
enum : uint32_t {
  kPromisesNoGhostForce = 1u << oracles::kRunPromises.size(),
  kPromisesMirror = kPromisesNoGhostForce << 1
};
uint32_t scene_promises(std::string_view words);

struct Scene {
  double h = 1;
  std::vector<Vec3> rest, velocity;           // [n]
  std::vector<double> mass;                   // [n]
  std::vector<uint8_t> held;                  // [n]
  std::vector<int32_t> node;                  // [n][3]
  std::vector<int32_t> nodes;                 // [3]
  std::vector<std::array<int32_t, 2>> edges;  // each once, the smaller end first
  std::vector<int32_t> tetrahedra, hexahedra;
  Vec3 gravity;
  double frame_time = 0;
  int64_t frames = 0, blades = 0;
  std::vector<Vec3> blade;  // [frames][blades][4]
  std::vector<Vec3> kick;   // [n] [m/s] added to velocities as the way to a frame begins
  int64_t kick_frame = -1;  // -1: none
  int64_t count() const { return std::ssize(rest); }
};
Arrays arrays_of(const Scene& scene);
// From the nodes of the particles: cubes of which all corners are particles, and six tetrahedra in each.
void add_cells(Scene& scene);
// The question to a plugin, in its precision and with its promises.
Question question_of(const Scene& scene, std::string kind, const PluginInfo& plugin);
// Requires that problem_of_scene() finds none.
Scene scene_of(const Arrays& arrays);
std::string problem_of_scene(const Question& question);  // "" or what is wrong
std::string size_of_scene(const Question& question);
// Numbers that a guest gets in single precision have it.
Array as_it_is_given(Array array, Precision precision);
std::vector<Vec3> vectors_of(const Array& array);
std::vector<double> numbers_of(const std::vector<Vec3>& vectors);

// Extent of the rest positions along a direction.
struct Range {
  double low = 0, high = 0;
};
Range range_along(const Scene& scene, Vec3 direction);
Vec3 axis_vector(int axis);
// Whether tetrahedra that share a corner are all joined by faces: a node or an edge alone joins no tissue.
bool is_joined_by_faces(const std::vector<int32_t>& tetrahedra);

std::vector<std::string> scene_kinds();
Question draw_scene(uint64_t seed, int64_t index, Precision precision);
// Within the plugin's limits, and with its promises.
Question draw_scene_for(uint64_t seed, int64_t index, const PluginInfo& plugin);
// Whether the judge found the tissue cut as this kind says.
bool is_as_drawn(const std::string& kind, const oracles::RunPieces& pieces);
// Whether scenes of this kind are one only if tissue is surely cut.
bool is_to_be_cut(std::string_view kind);

inline constexpr AnswerArray kRunAnswers[] = {
    {.name = "run/steps", .type = ElementType::i64, .text = "[1] substeps in a frame"},
    {.name = "run/damping", .real = true, .text = "[1] velocities decay by this rate [1/s]"},
    {.name = "run/particles", .type = ElementType::i32, .text = "[frames] how many"},
    {.name = "run/position", .real = true, .columns = 3, .text = "of all particles, frame by frame [m]"},
    {.name = "run/velocity", .real = true, .columns = 3, .text = "[m/s]"},
    {.name = "run/spin", .real = true, .columns = 3, .text = "angular momentum that they carry [kg m²/s]"},
    {.name = "run/mass", .real = true, .text = "[kg]"},
    {.name = "run/alive", .type = ElementType::u8, .text = "1: it exists"},
    {.name = "run/parent", .type = ElementType::i32, .text = "which one it was split from, or -1"},
    {.name = "run/contact_impulse", .real = true, .columns = 3, .text = "[frames] [kg m/s]"},
    {.name = "run/energy", .real = true, .text = "[frames] [J]"},
    {.name = "run/group_count", .type = ElementType::i32, .text = "[frames] coupling groups, or -1: as before"},
    {.name = "run/offsets", .type = ElementType::i64, .text = "of all groups that are given"},
    {.name = "run/members", .type = ElementType::i32, .text = "particles, group by group"},
    {.name = "run/weights", .real = true, .text = "of each member"},
    {.name = "run/cell_count", .type = ElementType::i32, .text = "[frames] cells, or -1: as before"},
    {.name = "run/tetrahedra", .type = ElementType::i32, .columns = 4, .text = "corners"},
    {.name = "run/hexahedra", .type = ElementType::i32, .columns = 8, .text = "corners, in VTK's order"},
    {.name = "run/seconds", .real = true, .text = "[frames] what the way to each frame took to compute"}};

// As files of arrays, one for each frame; or why that cannot be.
struct RunFiles {
  std::vector<io::ArrayFile> frames;
  std::string problem;
};
RunFiles run_files(const Question& question, const Arrays& answers, Precision precision);
std::vector<io::ArrayFile> files_of(const Question& question, const Arrays& answers, Precision precision);

// Promises of related runs: with one piece kicked, and mirrored.
std::vector<Verdict> judge_runs_beside(const Question& question, const Arrays& answers, Precision precision,
                                       const AskBeside& ask);

}  // namespace cutproof::guests::scenes
