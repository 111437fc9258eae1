// The JSON Schema of scenes: what it accepts beside what the reader does.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/error.h"
#include "model/io/input_file.h"
#include "model/io/limits.h"
#include "model/io/scene_io.h"
#include "model/rules.h"

namespace cutproof::io::scene_schema_test {
namespace {

using nlohmann::json;

TEST(SceneSchema, IsTheFileOfTheProject) {
  const std::string file = read_file(CUTPROOF_SOURCE_DIR "/fixtures/scene.schema.json", "A schema", kMiB);
  EXPECT_EQ(file, scene_schema()) << "Regenerate it: cutproof info --schema > fixtures/scene.schema.json";
}

// A scene in which every field is given that can be together with the others.
json full_scene() {
  Scene scene;
  scene.body.shape.emplace();
  scene.body.spacing = 0.01;
  StrokeSpec stroke;
  stroke.points = {{0, 0, 0}, {0.5, 1, 0}, {1, 0, 0}};
  stroke.along = Vec3{1, 0, 0};
  scene.blade.emplace().strokes = {stroke};
  scene.walls = {{2, -1, 0.5, 0}};
  scene.grips = {{{0, 0, 0}, {1, 1, 1}, 0, 1, false, {}}};
  Expectations& expect = scene.expect;
  expect.components_after_stroke = {2};
  expect.components_at_end = expect.shells_at_end = 2;
  expect.removed = expect.isolated_clusters = expect.cluster_growth = expect.clusters = Range{0, 7};
  expect.particles = expect.dent = expect.greatest_stretch = Range{3, 3};
  json tree = json::parse(write_scene(scene));
  tree["$schema"] = "../scene.schema.json";
  tree["ground"] = {{"offset", 0}, {"friction", 0}};
  return tree;
}

// Small scenes that have among them every field, every kind of shape and each side of every condition.
std::vector<json> bases() {
  const json full = full_scene();
  const json smallest = {{"version", 5}, {"body", {{"shape", {{"kind", "box"}}}, {"spacing", 0.01}}}};
  std::vector<json> found = {smallest};
  const auto add = [&](const char* name, const json& value) {
    found.push_back(smallest);
    found.back()[name] = value;
  };
  for (const auto& [name, value] : full.items()) {
    if (name != "walls" && name != "ground") add(name.c_str(), value);
  }
  add("material", {{"youngs_modulus", 1e4}, {"poisson_ratio", 0.45}, {"density", 1060}});
  json with_step = found.back();
  with_step["step"] = {{"solver", "implicit"}, {"iterations", 8}};
  found.push_back(with_step);
  add("walls", full["walls"]);
  found.back()["ground"] = full["ground"];
  for (const std::string_view kind : kShapeNames) {
    Scene scene;
    scene.body.shape.emplace().kind = *choice_named<Shape::Kind>(kind);
    scene.body.shape->parts.resize(1);
    add("body", {{"shape", json::parse(write_scene(scene))["body"]["shape"]}, {"particles", 1000}});
  }
  add("body", {{"mesh", {{"file", "a.stl"}, {"unit", 1}, {"repair", true}, {"repair_change", 0}}}, {"spacing", 1}});
  add("step", {{"solver", "published"}, {"acceleration", "none"}, {"retardation", 0}, {"volume_share", 0}});
  add("detect", {{"criterion", "geometric"}, {"remove", "both"}});
  json arc = full["blade"];
  arc["strokes"][0]["curve"] = "arc";
  add("blade", arc);
  return found;
}

// Every way to put another value in the place of one of a tree, to leave one out, and to add a field.
std::vector<json> damaged(const json& base) {
  const std::vector<json> values = json::parse(R"([null, true, "", "published", "geometric", "none", "arc", "union",
    -1, 0, 0.5, 1, 1e6, 1e18, [], {}, [0, 0, 0], [1, 2, 3], [[0, 0, 0]], [[0, 0, 0], [1, 0, 0]],
    [[0, 0, 0], [0, 0, 0], [0, 0, 0]]])");
  std::vector<json> found;
  const std::function<void(const json::json_pointer&)> visit = [&](const json::json_pointer& place) {
    const json& here = base.at(place);
    const auto with = [&](const auto& change) {
      found.push_back(base);
      change(found.back());
    };
    for (const json& value : values) with([&](json& tree) { tree.at(place) = value; });
    if (here.is_object()) with([&](json& tree) { tree.at(place)["another"] = 1; });
    if (!place.empty()) {
      with([&](json& tree) {
        json& around = tree.at(place.parent_pointer());
        if (around.is_object()) {
          around.erase(place.back());
        } else {
          around.push_back(around.back());
        }
      });
    }
    if (!here.is_structured()) return;
    for (const auto& [name, value] : here.items()) {
      visit(here.is_object() ? place / name : place / static_cast<std::size_t>(std::stoul(name)));
    }
  };
  visit(json::json_pointer());
  return found;
}

// What the reader says of it; empty if it is read.
std::string refusal(const json& scene) {
  try {
    static_cast<void>(parse_scene(scene.dump(), "scene.json"));
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

// scene_schema_test.py asks a validator about all of them.
TEST(SceneSchema, IsWrittenForTheValidator) {
  std::vector<json> scenes = bases();
  for (const json& base : bases()) {
    EXPECT_EQ(refusal(base), "") << base;
    for (json& one : damaged(base)) scenes.push_back(std::move(one));
  }
  json many = bases().front();
  for (int k = 0; k < 60; ++k) many["body"]["shape"]["parts"].push_back({{"kind", "ball"}});
  many["body"]["shape"]["kind"] = "union";
  json more = many;
  more["body"]["shape"]["parts"][0] = many["body"]["shape"];
  scenes.insert(scenes.end(), {many, more});
  json name = bases().front();
  for (int k = 0; k < 150; ++k) name["name"] = name.value("name", "") + "é";
  scenes.push_back(name);

  json documents = json::array();
  int read = 0;
  for (const json& scene : scenes) {
    documents.push_back({{"scene", scene}, {"refusal", refusal(scene)}});
    read += documents.back()["refusal"] == "";
  }
  EXPECT_GT(read, 300);
  EXPECT_GT(std::ssize(documents) - read, 3000);
  if (const char* folder = std::getenv("CUTPROOF_SCHEMA_FOLDER")) {
    std::filesystem::create_directories(folder);
    std::ofstream(std::string(folder) + "/documents.json") << documents;
    std::ofstream(std::string(folder) + "/schema.json") << scene_schema();
  }
}

}  // namespace
}  // namespace cutproof::io::scene_schema_test
