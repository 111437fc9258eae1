// Scenes: what is read can be written, and reads back equal.
#include <algorithm>
#include <filesystem>

#include "model/io/scene_io.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_scene {

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    const Scene scene = io::parse_scene(std::string(bytes), "scene.json");
    const std::string written = io::write_scene(scene);
    try {
      if (io::parse_scene(written, "written.json") == scene) return;
    } catch (const InputError& error) {
      broken_contract("a scene that was read is refused when it is written out: " + std::string(error.what()));
    }
    broken_contract("a scene changes when it is written out and read again:\n" + written);
  });
}

// The shipped scenes, and one with the fields that they leave out.
std::vector<std::string> seeds() {
  namespace fs = std::filesystem;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(CUTPROOF_SOURCE_DIR "/fixtures/scenes")) {
    if (entry.path().extension() == ".json") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> seeds;
  for (const fs::path& path : paths) seeds.push_back(bytes_of_file(path.string()));

  Scene scene;
  Shape ball, ring, both;
  ball.kind = Shape::Kind::ball;
  ring.kind = Shape::Kind::torus;
  both.kind = Shape::Kind::difference;
  both.parts = {Shape{}, ball, ring};
  scene.body.shape = both;
  scene.body.spacing = 0.01;
  scene.walls = {{0, -1, 0.5, 0.25}};
  scene.grips = {{{0, 0, 0}, {1, 1, 0.1}, 0, 0.5, true, {0, 0, 0.125}}};
  StrokeSpec arc;
  arc.curve = Curve::arc;
  arc.points = {{0, 0, 1}, {0.5, 0, 0.5}, {1, 0, 1}};
  arc.along = Vec3{0, 1, 0};
  scene.blade.emplace().strokes = {arc};
  scene.expect.components_after_stroke = {1};
  scene.expect.removed = Range{0, 12};
  scene.expect.dent = Range{0.5, 0.5};
  seeds.push_back(io::write_scene(scene));
  scene.body.shape.reset();
  scene.body.mesh = MeshSpec{"kidney.stl", 0.001, true};
  seeds.push_back(io::write_scene(scene));
  return seeds;
}

}  // namespace of_scene

const Target kScene = {"scene", of_scene::feed, of_scene::seeds};

}  // namespace cutproof::input_fuzzing
