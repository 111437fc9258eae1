#include "model/io/scene_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "model/error.h"
#include "model/io/input_file.h"
#include "model/io/limits.h"
#include "model/io/scene_fields.h"
#include "model/rules.h"
#include "model/setup_fields.h"

namespace cutproof::io::scene_io_test {
namespace {

using nlohmann::json;

const char* const kSmallest = R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.01}})";

json smallest() { return json::parse(kSmallest); }
json with_blade() {
  json scene = smallest();
  scene["blade"]["strokes"] = json::parse("[{\"points\": [[0, 0, 0], [1, 0, 0]]}]");
  return scene;
}

// The error that a text must give: where it is, and words that must stand in it.
void expect_error(const std::string& text, const std::string& field, const std::vector<std::string>& words) {
  SCOPED_TRACE(text.substr(0, 300));
  try {
    parse_scene(text, "scene.json");
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.file(), "scene.json");
    EXPECT_EQ(error.field(), field) << message;
    EXPECT_NE(message.find("\n  remedy: "), std::string::npos) << message;
    for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
  }
}
void expect_error(const json& scene, const std::string& field, const std::vector<std::string>& words) {
  expect_error(scene.dump(), field, words);
}

// Gives every field a value that differs from its default, every list two entries and every optional field a value:
// what the round trip loses, shows.
class Scrambler {
 public:
  template <class T>
  void field(T& value, const SceneField& f) {
    change(f, value);
  }
  bool applies(bool condition) const { return condition; }

 private:
  double number(const SceneField& f, double old) {
    const double low = std::max(f.bounds.low, -1e3), high = std::min(f.bounds.high, 1e3);
    fraction_ = fraction_ < 0.8 ? fraction_ + 1.0 / 64 + 1e-9 : 0.1;
    const double x = low + fraction_ * (high - low);
    return x == old ? (x + high) / 2 : x;
  }
  void change(const SceneField& f, double& value) { value = number(f, value); }
  template <class T>
  requires(std::is_integral_v<T>) void change(const SceneField& f, T& value) {
    if (f.name == "version") return;
    value = static_cast<T>(std::max(number(f, 0), f.bounds.low)) + 1;
    if (static_cast<double>(value) > f.bounds.high) value = static_cast<T>(f.bounds.high);
  }
  void change(const SceneField&, bool& value) { value = !value; }
  void change(const SceneField&, std::string& value) {
    value = "a \"text\" with \\ and é\n" + std::to_string(fraction_);
  }
  void change(const SceneField& f, Vec3& value) {
    for (int axis = 0; axis < 3; ++axis) value[axis] = number(f, value[axis]);
    if (f.name == "high") value = {1000, 1000, 1000};  // above every "low"
  }
  void change(const SceneField& f, Range& value) {
    value.low = number(f, 0);
    value.high = value.low + 0.5;
    if (++ranges_ % 3 == 0) value.high = value.low;
    if (ranges_ % 3 == 1) value.high = std::numeric_limits<double>::infinity();
  }
  template <class E>
  requires(std::is_enum_v<E>) void change(const SceneField&, E& value) {
    if constexpr (!std::is_same_v<E, Shape::Kind> && !std::is_same_v<E, Curve>)
      value = static_cast<E>(names_of(E{}).size() - 1);
  }
  template <class T>
  void change(const SceneField& f, std::optional<T>& value) {
    // Other ways to give walls, shape, and stiffness.
    if (f.name == "ground" || f.name == "mesh" || f.name == "material") return;
    change(f, value.emplace());
  }
  template <class T>
  void change(const SceneField& f, std::vector<T>& value) {
    for (int i = 0; i < 2; ++i) change(f, value.emplace_back());
  }
  template <class T>
  requires(std::is_class_v<T>) void change(const SceneField& f, T& value) {
    describe(*this, value);
    if constexpr (std::is_same_v<T, BodySpec>) value.particles = 0;
    if constexpr (std::is_same_v<T, StepParameters>) value.acceleration = Acceleration::none;  // excludes `published`
    if constexpr (std::is_same_v<T, StepParameters>) value.retardation = value.volume_share = 0;  // likewise
    if constexpr (std::is_same_v<T, DetectFields>)
      value.parameters.remove = RemovedEnds::both;  // excludes most criteria
    if constexpr (std::is_same_v<T, WallSpec>) value.side = -1;
    if constexpr (std::is_same_v<T, GripSpec>) value.end = value.start + 0.25;
    (void)f;
  }
  double fraction_ = 0.1;
  int ranges_ = 0;
};

Scene scrambled() {
  Scene scene;
  Scrambler scrambler;
  describe(scrambler, scene);
  return scene;
}

// The bounds of every number in a group of fields.
struct Probe {
  std::string path;
  std::vector<std::pair<std::string, Bounds>> found;
  void field(bool&, const SceneField&) {}
  void field(double&, const SceneField& f) { found.emplace_back(f.name, f.bounds); }
  void field(int32_t&, const SceneField& f) { found.emplace_back(f.name, f.bounds); }
  template <class T>
  void field(T&, const SceneField&) {}
  bool applies(bool) const { return true; }
};

TEST(SceneIo, TheSmallestSceneHasTheDefaultsOfTheStructs) {
  const Scene scene = parse_scene(kSmallest, "scene.json");
  const Scene fresh;
  EXPECT_EQ(scene.step, fresh.step);
  EXPECT_EQ(scene.detect, fresh.detect);
  EXPECT_EQ(scene.frame_length, fresh.frame_length);
  EXPECT_EQ(scene.seed, fresh.seed);
  EXPECT_EQ(scene.clusters.side, fresh.clusters.side);
  EXPECT_FALSE(scene.blade.has_value());
  ASSERT_TRUE(scene.body.shape.has_value());
  EXPECT_EQ(scene.body.shape->size, fresh.body.shape.value_or(Shape{}).size);
  EXPECT_EQ(scene.body.spacing, 0.01);
}

TEST(SceneIo, EveryFieldSurvivesWritingAndReading) {
  const Scene scene = scrambled();
  const std::string text = write_scene(scene);
  EXPECT_EQ(write_scene(parse_scene(text, "scene.json")), text);
  // Nothing was left at its default, or the comparison above would say nothing of it.
  const json tree = json::parse(text);
  Scene plain;
  plain.blade.emplace();
  const json defaults = json::parse(write_scene(plain));
  for (const char* group : {"clusters", "frame", "step", "detect", "split", "merge", "expand", "skin", "blade"}) {
    for (const auto& [name, value] : tree[group].items()) {
      // AccelerationIsFor…, RetardationIsFor…, VolumeShareIsFor…, OneEndIsFor…
      if (name == "acceleration" || name == "retardation" || name == "volume_share" || name == "remove") continue;
      EXPECT_NE(value, defaults[group].value(name, json())) << group << "." << name << " kept its default";
    }
  }
  EXPECT_EQ(tree["blade"]["strokes"].size(), 2u);
  EXPECT_EQ(tree["walls"].size(), 2u);
  EXPECT_EQ(tree["grips"].size(), 2u);
  EXPECT_EQ(tree["expect"].size(), 10u) << "an expectation is not written";
}

TEST(SceneIo, EveryFieldThatIsWrittenIsReadAgainAlone) {
  // Taking out any one optional field changes what is read: no field is ignored by the reader.
  const std::string whole = write_scene(scrambled());
  const json tree = json::parse(whole);
  for (const char* group : {"clusters", "frame", "step", "detect", "split", "merge", "expand", "skin", "expect"}) {
    for (const auto& [name, value] : tree[group].items()) {
      if (name == "acceleration" || name == "retardation" || name == "volume_share" || name == "remove") continue;
      json less = tree;
      less[group].erase(name);
      EXPECT_NE(write_scene(parse_scene(less.dump(), "scene.json")), whole) << group << "." << name;
    }
  }
}

// The next greater value of its kind; of a choice the next one.
template <class T>
void change_slightly(T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    value = !value;
  } else if constexpr (std::is_enum_v<T>) {
    value = static_cast<T>((static_cast<std::size_t>(value) + 1) % names_of(value).size());
  } else if constexpr (std::is_integral_v<T>) {
    value += 1;
  } else {
    value = std::nextafter(value, 1e300);
  }
}

// What a scene says of each stage goes into the setup as it is, so each such field of a setup must come back.
TEST(SceneIo, EachFieldOfASetupsStagesComesBackChangedAlone) {
  const auto from_scene = [](const Scene& scene) {
    cutproof::Setup setup;
    setup.step = scene.step;
    setup.detect = scene.detect;
    setup.split = scene.split;
    setup.merge = scene.merge;
    setup.expand = scene.expand;
    setup.skin = scene.skin;
    return setup;
  };
  const auto round_trip = [&](const cutproof::Setup& setup) {
    Scene scene = parse_scene(kSmallest, "scene.json");
    scene.step = setup.step;
    scene.detect = setup.detect;
    scene.split = setup.split;
    scene.merge = setup.merge;
    scene.expand = setup.expand;
    scene.skin = setup.skin;
    return from_scene(parse_scene(write_scene(scene), "scene.json"));
  };
  cutproof::Setup base = from_scene(parse_scene(kSmallest, "scene.json"));
  base.step.acceleration = Acceleration::none;  // so that the solver may change alone
  base.detect.remove = RemovedEnds::both;       // and the criterion
  int changes = 0;
  for_each_setup_field([&](const SetupField& field, auto get) {
    const auto groups = {"step", "detect", "split", "merge", "expand", "skin"};
    if (std::find(groups.begin(), groups.end(), field.group) == groups.end()) return;
    using T = std::remove_cvref_t<decltype(get(base))>;
    const auto comes_back = [&](const auto& change) {
      SCOPED_TRACE(std::string(field.group) + "." + std::string(field.name));
      cutproof::Setup changed = base;
      change(get(changed));
      const cutproof::Setup found = round_trip(changed);
      EXPECT_FALSE(get(found) == get(base));
      for_each_setup_field([&](const SetupField& other, auto of) {
        EXPECT_TRUE(of(found) == of(changed)) << other.group << "." << other.name;
      });
      ++changes;
    };
    if constexpr (std::is_same_v<T, Vec3>) {
      for (int axis = 0; axis < 3; ++axis) comes_back([&](Vec3& value) { change_slightly(value[axis]); });
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      comes_back([](T& value) { change_slightly(value); });
    } else {
      ADD_FAILURE() << field.group << "." << field.name << " is of a kind that this test does not change";
    }
  });
  EXPECT_GE(changes, 20);
}

// Changes the n-th value that a scene has, as little as its bounds allow, and none if there are fewer.
class ChangeOne {
 public:
  explicit ChangeOne(int n) : left_(n) {}
  std::string changed;  // the name of the field

  template <class T>
  void field(T& value, const SceneField& f) {
    change(f, value);
  }
  bool applies(bool condition) const { return condition; }

 private:
  bool is_this_one(const SceneField& f) {
    if (left_-- != 0) return false;
    changed = f.name;
    return true;
  }
  // What is written alone must be allowed alone.
  static bool is_bound_to_others(const SceneField& f) { return f.name == "version" || f.name == "solver"; }

  template <class T>
  requires(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) void change(const SceneField& f, T& value) {
    if (is_bound_to_others(f) || (f.presence == kZeroIsAbsent && value == 0) || !is_this_one(f)) return;
    if (f.name == "side" && f.bounds.low == -1) {
      value = -value;
    } else if constexpr (std::is_floating_point_v<T>) {
      const T up = std::nextafter(value, T(1e300));
      value = f.bounds.contains(up) ? up : std::nextafter(value, T(-1e300));
    } else {
      value = f.bounds.contains(static_cast<double>(value) + 1) ? value + 1 : value - 1;
    }
  }
  void change(const SceneField& f, bool& value) {
    if (is_this_one(f)) value = !value;
  }
  void change(const SceneField& f, std::string& value) {
    if (is_this_one(f)) value += "\t2";
  }
  void change(const SceneField& f, Vec3& value) {
    for (int axis = 0; axis < 3; ++axis) {
      if (is_this_one(f)) value[axis] = std::nextafter(value[axis], -1e300);
    }
  }
  void change(const SceneField& f, Range& value) {
    if (is_this_one(f)) value.low = std::nextafter(value.low, -1e300);
    if (is_this_one(f)) value.high = std::isinf(value.high) ? value.low + 1 : std::nextafter(value.high, 1e300);
  }
  template <class E>
  requires(std::is_enum_v<E>) void change(const SceneField& f, E& value) {
    if constexpr (std::is_same_v<E, Shape::Kind> || std::is_same_v<E, Curve>) return;  // they ask for other fields
    if (is_bound_to_others(f) || !is_this_one(f)) return;
    value = static_cast<E>((static_cast<std::size_t>(value) + 1) % names_of(value).size());
  }
  template <class T>
  void change(const SceneField& f, std::optional<T>& value) {
    if (value) change(f, *value);
  }
  template <class T>
  void change(const SceneField& f, std::vector<T>& value) {
    for (T& entry : value) change(f, entry);
  }
  template <class T>
  requires(std::is_class_v<T>) void change(const SceneField&, T& value) { describe(*this, value); }

  int left_;
};

TEST(SceneIo, EachValueComesBackChangedAlone) {
  // With a mesh and without; with the path of a blade that is an arc; with the solver that can be accelerated, and the
  // criterion that may take one end.
  Scene shaped = scrambled(), meshed = scrambled();
  shaped.step.solver = meshed.step.solver = Solver::implicit;
  shaped.detect.criterion = meshed.detect.criterion = Criterion::distance;
  meshed.body.shape.reset();
  meshed.body.mesh = {"organ.stl", 1e-3};
  meshed.body.spacing = 0;
  meshed.body.particles = 1000;
  meshed.blade->strokes[0].curve = Curve::arc;
  meshed.blade->strokes[0].points = {{0, 0, 0}, {0.5, 0.25, 0}, {1, 0, 0}};
  for (const Scene& base : {shaped, meshed}) {
    ASSERT_EQ(parse_scene(write_scene(base), "scene.json"), base);
    int changes = 0;
    for (;; ++changes) {
      Scene changed = base;
      ChangeOne one(changes);
      describe(one, changed);
      if (one.changed.empty()) break;
      SCOPED_TRACE(one.changed + ", value " + std::to_string(changes));
      ASSERT_FALSE(changed == base);
      const auto faces = [&](const WallSpec& a, const WallSpec& b) {
        return a.axis == b.axis && a.side != b.side && a.side * (b.offset - a.offset) <= 0;
      };
      if (changed.walls.size() == 2 && faces(changed.walls[0], changed.walls[1])) {  // no room: refused
        EXPECT_THROW(static_cast<void>(parse_scene(write_scene(changed), "scene.json")), InputError);
        continue;
      }
      EXPECT_EQ(parse_scene(write_scene(changed), "scene.json"), changed);
    }
    EXPECT_GE(changes, 100);
  }
}

// One number, from one number on, up to one, and between two: zero is a number as any other.
TEST(SceneIo, RangesKeepBothTheirEnds) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Scene scene = parse_scene(kSmallest, "scene.json");
  for (const Range range :
       {Range{0, 0}, {0, 5}, {0, kInfinity}, {3, 3}, {3, kInfinity}, {-kInfinity, 5}, {-kInfinity, 0}}) {
    scene.expect.removed = scene.expect.cluster_growth = range;
    EXPECT_EQ(parse_scene(write_scene(scene), "scene.json"), scene) << range.low << " to " << range.high;
  }
}

TEST(SceneIo, AccelerationIsForTheImplicitSolver) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  scene.step.acceleration = Acceleration::chebyshev;
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").step, scene.step);
  json tree = json::parse(write_scene(scene));
  tree["step"]["solver"] = "published";
  expect_error(tree, "step.acceleration", {"published", "implicit", "none"});
  tree["step"]["acceleration"] = "none";
  EXPECT_EQ(parse_scene(tree.dump(), "scene.json").step.solver, Solver::published);
}

TEST(SceneIo, RetardationIsForTheImplicitSolver) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  EXPECT_EQ(scene.step.retardation, 0) << "what was written before there was any has none";
  scene.step.retardation = 0.004;
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").step, scene.step);
  json tree = json::parse(write_scene(scene));
  tree["step"]["solver"] = "published";
  tree["step"]["acceleration"] = "none";
  expect_error(tree, "step.retardation", {"published", "implicit", "leave"});
  tree["step"]["retardation"] = 0;
  EXPECT_EQ(parse_scene(tree.dump(), "scene.json").step.solver, Solver::published);
}

TEST(SceneIo, VolumeShareIsForTheImplicitSolver) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  EXPECT_EQ(scene.step.volume_share, 0);
  scene.step.volume_share = 0.5;
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").step, scene.step);
  json tree = json::parse(write_scene(scene));
  tree["step"]["solver"] = "published";
  tree["step"]["acceleration"] = "none";
  expect_error(tree, "step.volume_share", {"published", "implicit", "leave"});
  tree["step"]["volume_share"] = 0;
  EXPECT_EQ(parse_scene(tree.dump(), "scene.json").step.solver, Solver::published);
}

TEST(SceneIo, AMaterialIsGivenInPlaceOfWhatFollowsFromIt) {
  json tree = json::parse(kSmallest);
  tree["material"] = {{"youngs_modulus", 1e4}, {"poisson_ratio", 0.45}, {"density", 1060}};
  const Scene scene = parse_scene(tree.dump(), "scene.json");
  ASSERT_TRUE(scene.material);
  EXPECT_EQ(scene.material->poisson_ratio, 0.45);
  EXPECT_EQ(scene.body.density, 1060);
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json"), scene);
  for (const auto& [group, name] : {std::pair{"body", "density"}, {"step", "stiffness"}, {"step", "volume_share"}}) {
    json both = tree;
    both[group][name] = 0.5;
    expect_error(both, std::string(group) + "." + name, {"material", "Leave"});
  }
  json published = tree;
  published["step"] = {{"solver", "published"}};
  expect_error(published, "material", {"published", "implicit"});
  for (const char* name : {"youngs_modulus", "poisson_ratio", "density"}) {
    json less = tree;
    less["material"].erase(name);
    expect_error(less, std::string("material.") + name, {"missing"});
  }
  tree["material"]["poisson_ratio"] = 0.5;
  expect_error(tree, "material.poisson_ratio", {"bounds", "0.49"});
}

TEST(SceneIo, OneEndIsForTheCriterionOfEdges) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  EXPECT_EQ(scene.detect.remove, RemovedEnds::nearer);
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").detect, scene.detect);
  json tree = json::parse(write_scene(scene));
  for (const char* criterion : {"none", "geometric", "strain"}) {
    tree["detect"]["criterion"] = criterion;
    expect_error(tree, "detect.remove", {criterion, "distance", "both"});
  }
  tree["detect"]["remove"] = "both";
  EXPECT_EQ(parse_scene(tree.dump(), "scene.json").detect.criterion, Criterion::strain);
}

TEST(SceneIo, NumbersKeepAllTheirBits) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  for (const double x : {0.1, 1.0 / 3.0, 4.9406564584124654e-324, 1e-300, 123456.78901234567}) {
    scene.body.spacing = x;
    EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").body.spacing, x);
  }
  scene.body.spacing = 1;
  scene.seed = std::numeric_limits<uint64_t>::max();
  EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").seed, scene.seed);
}

TEST(SceneIo, EveryWordOfEveryEnumerationIsReadBack) {
  Scene scene = parse_scene(kSmallest, "scene.json");
  scene.detect.remove = RemovedEnds::both;  // so that the criterion may change alone
  const auto each = []<class E>(E, auto&& visit) {
    for (std::size_t i = 0; i < names_of(E{}).size(); ++i) visit(static_cast<E>(i));
  };
  each(Criterion{}, [&](Criterion criterion) {
    each(MergeRule{}, [&](MergeRule merge) {
      each(ExpandRule{}, [&](ExpandRule expand) {
        scene.detect.criterion = criterion;
        scene.merge.rule = merge;
        scene.expand.rule = expand;
        const Scene back = parse_scene(write_scene(scene), "scene.json");
        EXPECT_EQ(back.detect.criterion, criterion) << name_of(criterion);
        EXPECT_EQ(back.merge.rule, merge) << name_of(merge);
        EXPECT_EQ(back.expand.rule, expand) << name_of(expand);
      });
    });
  });
  each(Shape::Kind{}, [&](Shape::Kind kind) {
    scene.body.shape->kind = kind;
    scene.body.shape->parts.assign(2, Shape{});
    EXPECT_EQ(parse_scene(write_scene(scene), "scene.json").body.shape->kind, kind) << name_of(kind);
  });
  EXPECT_NE(write_scene(parse_scene(R"({"version": 5, "body": {"shape": {"kind": "union", "parts": [{"kind": "box"}]},
            "spacing": 1}})",
                                    "s"))
                .find("\"union\""),
            std::string::npos);
}

TEST(SceneIo, TheGroundIsTheWallThatHeaderSays) {
  json tree = smallest();
  tree["ground"] = {{"friction", 0.5}, {"offset", -0.25}};
  tree["walls"] = json::parse(R"([{"axis": 0, "side": -1, "offset": 2}])");
  const Scene scene = parse_scene(tree.dump(), "scene.json");
  ASSERT_EQ(scene.walls.size(), 2u);
  EXPECT_EQ(scene.walls[0].axis, 2);
  EXPECT_EQ(scene.walls[0].side, +1);
  EXPECT_EQ(scene.walls[0].offset, -0.25);
  EXPECT_EQ(scene.walls[0].friction, 0.5);
  EXPECT_EQ(scene.walls[1].axis, 0);
}

TEST(SceneIo, RangesAreOneNumberOrOpenOnOneSide) {
  json tree = smallest();
  tree["expect"] = json::parse(R"({"removed": {"at_least": 1}, "isolated_clusters": 0, "dent": {"at_most": 2}})");
  const Scene scene = parse_scene(tree.dump(), "scene.json");
  EXPECT_EQ(scene.expect.removed->low, 1);
  EXPECT_EQ(scene.expect.removed->high, std::numeric_limits<double>::infinity());
  EXPECT_EQ(scene.expect.isolated_clusters->low, 0);
  EXPECT_EQ(scene.expect.isolated_clusters->high, 0);
  EXPECT_EQ(scene.expect.dent->high, 2);
  EXPECT_FALSE(scene.expect.particles.has_value());
  tree["expect"] = json::parse(R"({"removed": {"at_least": 3, "at_most": 2}})");
  expect_error(tree, "expect.removed", {"3", "2"});
  tree["expect"] = json::parse(R"({"removed": {"least": 3}})");
  expect_error(tree, "expect.removed.least", {"at_least"});
  tree["expect"] = json::parse(R"({"removed": {}})");
  expect_error(tree, "expect.removed", {"at_least"});
}

TEST(SceneIoErrors, AnUnknownFieldNamesTheNearestKnownOne) {
  json tree = smallest();
  tree["body"]["spacng"] = 0.01;
  tree["body"].erase("spacing");
  expect_error(tree, "body.spacng", {"not known", "\"spacing\""});
  tree = smallest();
  tree["stepp"] = json::object();
  expect_error(tree, "stepp", {"\"step\""});
  tree = with_blade();
  tree["blade"]["strokes"][0]["pionts"] = 1;
  expect_error(tree, "blade.strokes[0].pionts", {"\"points\""});
  tree = smallest();
  tree["body"]["shape"]["radius"] = 1;  // not of boxes
  expect_error(tree, "body.shape.radius", {"not known here", "size"});
  for (const auto& [kind, field] : {std::pair{"ball", "along"},
                                    {"cylinder", "size"},
                                    {"cylinder", "tube"},
                                    {"capsule", "tube"},
                                    {"torus", "length"},
                                    {"union", "center"}}) {
    tree["body"]["shape"] = {{"kind", kind}, {field, 1}};
    expect_error(tree, std::string("body.shape.") + field, {"not known here", "kind"});
  }
}

TEST(SceneIoErrors, AFieldThatIsGivenTwiceIsRefused) {
  expect_error(std::string(R"({"version": 5, "body": {"spacing": 1, "shape": {"kind": "box"}, "spacing": 2}})"),
               "body.spacing", {"twice"});
  expect_error(std::string(R"({"version": 5, "grips": [{"low": [0,0,0]}, {"end": 1, "end": 1}]})"), "grips[1].end",
               {"twice"});
}

TEST(SceneIoErrors, WrongTypesNameWhatIsThereAndWhatIsNeeded) {
  json tree = smallest();
  tree["body"]["spacing"] = "0.01";
  expect_error(tree, "body.spacing", {"number", "0.01"});
  tree = smallest();
  tree["step"]["substeps"] = 2.5;
  expect_error(tree, "step.substeps", {"whole number", "2.5"});
  tree = smallest();
  tree["step"]["gravity"] = -9.81;
  expect_error(tree, "step.gravity", {"vector", "[x, y, z]"});
  tree["step"]["gravity"] = {0, 0};
  expect_error(tree, "step.gravity", {"2 entries"});
  tree["step"]["gravity"] = {0, 0, "down"};
  expect_error(tree, "step.gravity[2]", {"down"});
  tree = smallest();
  tree["detect"]["without_blade"] = 1;
  expect_error(tree, "detect.without_blade", {"true or false"});
  tree = smallest();
  tree["detect"]["criterion"] = "distence";
  expect_error(tree, "detect.criterion", {"distence", "\"distance\"", "\"strain\""});
  tree = smallest();
  tree["walls"] = json::object();
  expect_error(tree, "walls", {"list"});
  tree["walls"] = json::parse(R"([{"axis": 2, "side": -1, "offset": 0.25}])");
  tree["ground"] = {{"offset", 0.5}};
  expect_error(tree, "walls", {"no room", "0.5 upwards", "0.25 downwards"});
  tree["ground"] = {{"offset", 0.125}};
  static_cast<void>(parse_scene(tree.dump(), "scene.json"));
  tree = smallest();
  tree["skin"] = true;
  expect_error(tree, "skin", {"object"});
  tree = smallest();
  tree["frame"] = json::array();
  expect_error(tree, "frame", {"object"});
  tree = smallest();
  tree["blade"] = nullptr;
  expect_error(tree, "blade", {"null"});
}

TEST(SceneIoErrors, WholeNumbersMayBeWrittenWithAnExponent) {
  json tree = smallest();
  tree["body"].erase("spacing");
  tree["body"]["particles"] = 1e5;
  EXPECT_EQ(parse_scene(tree.dump(), "scene.json").body.particles, 100000);
}

TEST(SceneIoErrors, ValuesBeyondTheirBoundsAreRefusedAndValuesAtThemAreNot) {
  // Each bounded number of these groups, from the table itself: just inside passes, just outside does not.
  int tested = 0;
  const auto test_group = [&tested](auto value, const std::string& group) {
    Probe probe;
    describe(probe, value);
    for (const auto& [name, bounds] : probe.found) {
      const auto parse = [&group, name = name](double x) {
        json tree = with_blade();
        tree[group][name] = x;
        parse_scene(tree.dump(), "scene.json");
      };
      SCOPED_TRACE(group + "." + name);
      ASSERT_TRUE(std::isfinite(bounds.low) && std::isfinite(bounds.high)) << "a number without bounds";
      if (bounds.open_low) {
        EXPECT_THROW(parse(bounds.low), InputError);
      } else {
        EXPECT_NO_THROW(parse(bounds.low));
      }
      if (bounds.open_high) {
        EXPECT_THROW(parse(bounds.high), InputError);
      } else {
        EXPECT_NO_THROW(parse(bounds.high));
      }
      EXPECT_THROW(parse(bounds.low - 1), InputError);
      EXPECT_THROW(parse(bounds.high * 1.5 + 1), InputError);
      ++tested;
    }
  };
  test_group(ClusterSpec{}, "clusters");
  test_group(StepParameters{}, "step");
  test_group(DetectParameters{}, "detect");
  test_group(SplitParameters{}, "split");
  test_group(ExpandParameters{}, "expand");
  test_group(SkinParameters{}, "skin");
  test_group(BladeSpec{}, "blade");
  EXPECT_GE(tested, 21) << "the table lost fields";
}

TEST(SceneIoErrors, ANegativeSpacingNamesItsValueAndItsBounds) {
  json tree = smallest();
  tree["body"]["spacing"] = -0.01;
  expect_error(tree, "body.spacing", {"-0.01", "greater than 0"});
  tree["body"]["spacing"] = 0;
  expect_error(tree, "body.spacing", {"greater than 0"});
}

TEST(SceneIoErrors, NotANumberIsAnErrorOfTheTextWithItsPosition) {
  expect_error(std::string("{\"version\": 5,\n \"body\": {\"spacing\": NaN}}"), "line 2, column 22",
               {"not valid JSON", "NaN", "finite"});
  expect_error(std::string("{\"version\": 5,\n\"body\": {\"spacing\": -Infinity}}"), "line 2, column 22", {"finite"});
}

TEST(SceneIoErrors, ANumberTooLargeForTheMachineNamesItsField) {
  expect_error(std::string(R"({"version": 5, "step": {"gravity": [0, 1e999, 0]}})"), "step.gravity[0]", {"1e999"});
  expect_error(std::string(R"({"version": 5, "body": {"spacing": -1e999}})"), "body.spacing", {"1e999"});
  expect_error(std::string(R"({"version": 5, "seed": 18446744073709551616, "body": {"shape": {"kind": "box"},
               "spacing": 1}})"),
               "seed", {"too large"});
}

TEST(SceneIoErrors, BrokenJsonNamesLineAndColumn) {
  expect_error(std::string("{\"version\": 5,\n \"body\": {\n"), "line 3, column 1", {"unexpected end of input"});
  expect_error(std::string("{\"version\": 5 \"body\": {}}"), "line 1, column 20", {"not valid JSON"});
  expect_error(std::string("{} x"), "line 1, column 4", {"not valid JSON"});
  expect_error(std::string("{\"name\": \"\xff\"}"), "line 1, column 11", {"not valid JSON"});
  expect_error(std::string(""), "", {"empty"});
  expect_error(std::string(" \n\t"), "", {"empty"});
  expect_error(std::string("solid organ\n"), "line 1, column 1", {"not valid JSON"});
}

TEST(SceneIoErrors, MissingRequiredFieldsAreNamed) {
  expect_error(std::string(R"({"version": 5})"), "body", {"missing"});
  expect_error(std::string(R"({"body": {}})"), "version", {"missing"});
  json tree = smallest();
  tree["body"]["shape"].erase("kind");
  expect_error(tree, "body.shape.kind", {"missing"});
  tree = smallest();
  tree["body"] = json::parse(R"({"mesh": {"file": "a.stl"}, "spacing": 1})");
  expect_error(tree, "body.mesh.unit", {"missing"});
  tree = smallest();
  tree["grips"] = json::parse(R"([{"low": [0, 0, 0]}])");
  expect_error(tree, "grips[0].high", {"missing"});
}

// A scene of the test's box, with these fields too.
Scene box_with(const std::string& fields) {
  return parse_scene(R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.01})" + fields + "}",
                     "scene.json");
}

TEST(SceneIo, TheSolverSaysHowItIteratesIfNothingElseDoes) {
  const auto acceleration = [](const std::string& step) { return box_with(R"(, "step": )" + step).step.acceleration; };
  EXPECT_EQ(acceleration("{}"), Acceleration::chebyshev);
  EXPECT_EQ(acceleration(R"({"solver": "implicit", "iterations": 2})"), Acceleration::chebyshev);
  EXPECT_EQ(acceleration(R"({"solver": "published"})"), Acceleration::none);
  EXPECT_EQ(acceleration(R"({"acceleration": "none"})"), Acceleration::none);
  expect_error(std::string(R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.01},
                               "step": {"solver": "published", "acceleration": "chebyshev"}})"),
               "step.acceleration", {"published"});
  expect_error(
      std::string(R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.01}, "step": {"solver": 7}})"),
      "step.solver", {"7"});
  EXPECT_EQ(Scene{}.step, box_with("").step);
}

TEST(SceneIo, TheCriterionSaysWhichEndsGoIfNothingElseDoes) {
  const auto removed = [](const std::string& detect) { return box_with(R"(, "detect": )" + detect).detect.remove; };
  EXPECT_EQ(removed("{}"), RemovedEnds::nearer);
  EXPECT_EQ(removed(R"({"criterion": "distance", "epsilon": 2})"), RemovedEnds::nearer);
  for (const char* criterion : {"none", "geometric", "strain"}) {
    EXPECT_EQ(removed(R"({"criterion": ")" + std::string(criterion) + R"("})"), RemovedEnds::both) << criterion;
  }
  EXPECT_EQ(removed(R"({"remove": "one"})"), RemovedEnds::one);
  EXPECT_EQ(removed(R"({"remove": "both"})"), RemovedEnds::both);
  EXPECT_EQ(Scene{}.detect, box_with("").detect);
}

TEST(SceneIo, ASkinIsFittedUnlessTheSceneSaysOtherwise) {
  EXPECT_TRUE(box_with("").body.fit_skin);
  EXPECT_FALSE(parse_scene(R"({"version": 5, "body": {"shape": {"kind": "box"}, "spacing": 0.01, "fit_skin": false}})",
                           "scene.json")
                   .body.fit_skin);
  // Cut faces likewise.
  EXPECT_TRUE(box_with("").skin.fit_cuts);
  EXPECT_TRUE(box_with(R"(, "skin": {"alpha": 0.4})").skin.fit_cuts);
  EXPECT_FALSE(box_with(R"(, "skin": {"fit_cuts": false})").skin.fit_cuts);
}

TEST(SceneIoErrors, AnotherVersionIsRefusedBeforeAnythingElse) {
  for (const char* const version : {"1", "2", "3", "4", "6"}) {
    expect_error(R"({"version": )" + std::string(version) + R"(, "new_field": true})", "version",
                 {version, "only version 5 is read"});
  }
  expect_error(std::string(R"({"version": 5.5})"), "version", {"5.5"});
  expect_error(std::string(R"({"version": "5"})"), "version", {"\"5\""});
  expect_error(std::string(R"([1])"), "", {"object", "list"});
}

TEST(SceneIoErrors, ExactlyOneOfShapeAndMeshAndOfSpacingAndParticles) {
  json tree = smallest();
  tree["body"]["mesh"] = {{"file", "a.stl"}, {"unit", 0.001}};
  expect_error(tree, "body", {"Both shape and mesh"});
  tree = smallest();
  tree["body"].erase("shape");
  expect_error(tree, "body", {"Neither shape nor mesh"});
  tree = smallest();
  tree["body"]["particles"] = 100;
  expect_error(tree, "body", {"Both spacing and particles"});
  tree = smallest();
  tree["body"].erase("spacing");
  expect_error(tree, "body", {"Neither spacing nor particles"});
}

TEST(SceneIoErrors, AnEmptyBladePathHasItsOwnMessage) {
  json tree = with_blade();
  tree["blade"]["strokes"] = json::array();
  expect_error(tree, "blade.strokes", {"path is empty"});
  tree = with_blade();
  tree["blade"]["strokes"][0]["points"] = json::array();
  expect_error(tree, "blade.strokes[0].points", {"path is empty", "0 points", "two points"});
  tree["blade"]["strokes"][0]["points"] = json::parse("[[0, 0, 0]]");
  expect_error(tree, "blade.strokes[0].points", {"path is empty", "1 point."});
  tree["blade"]["strokes"][0]["points"] = json::parse("[[0, 0, 0], [0, 0, 0], [0, 0, 0]]");
  expect_error(tree, "blade.strokes[0].points", {"path is empty", "same"});
  tree["blade"].erase("strokes");
  expect_error(tree, "blade.strokes", {"missing"});
  // A stroke that stands still on purpose is a hard case, not a mistake.
  tree = with_blade();
  tree["blade"]["strokes"][0]["points"] = json::parse("[[0, 0, 0], [0, 0, 0]]");
  EXPECT_NO_THROW(parse_scene(tree.dump(), "scene.json"));
}

TEST(SceneIoErrors, ConditionsBetweenFieldsAreChecked) {
  json tree = with_blade();
  tree["blade"]["strokes"][0]["curve"] = "arc";
  expect_error(tree, "blade.strokes[0].points", {"three points"});
  tree = smallest();
  tree["walls"] = json::parse(R"([{"side": 0}])");
  expect_error(tree, "walls[0].side", {"1 or -1"});
  tree = smallest();
  tree["grips"] = json::parse(R"([{"low": [0, 0.5, 0], "high": [1, 0.25, 1]}])");
  expect_error(tree, "grips[0].low", {"0.5", "0.25"});
  tree["grips"] = json::parse(R"([{"low": [0, 0, 0], "high": [1, 1, 1], "start": 2, "end": 1}])");
  expect_error(tree, "grips[0].end", {"1", "2"});
  tree = smallest();
  tree["body"]["shape"] = json::parse(R"({"kind": "union", "parts": []})");
  expect_error(tree, "body.shape.parts", {"empty"});
  tree["body"]["shape"] = json::parse(R"({"kind": "cylinder", "along": [0, 0, 0]})");
  expect_error(tree, "body.shape.along", {"not a direction"});
  tree["body"]["shape"] = json::parse(R"({"kind": "torus", "radius": 0.01, "tube": 0.01})");
  expect_error(tree, "body.shape.tube", {"closes the hole", "less than the radius"});
}

TEST(SceneIoErrors, ShapesNestedWithoutEndAreRefused) {
  std::string text = R"({"kind": "ball"})";
  for (int i = 0; i < 5000; ++i) text = R"({"kind": "union", "parts": [)" + std::exchange(text, "") + "]}";
  const std::string scene = R"({"version": 5, "body": {"spacing": 1, "shape": )" + text + "}}";
  EXPECT_THROW(parse_scene(scene, "scene.json"), InputError);
}

TEST(SceneIoErrors, AMissingSceneFileIsNamed) {
  try {
    read_scene("no/such/scene.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "no/such/scene.json");
  }
}

TEST(SceneReference, NamesEveryFieldThatIsWritten) {
  const std::string reference = scene_reference();
  const std::function<void(const json&)> visit = [&](const json& tree) {
    for (const auto& [name, value] : tree.items()) {
      if (tree.is_object()) {
        EXPECT_NE(reference.find("- `" + name + "`:"), std::string::npos) << name << " is not documented";
      }
      if (value.is_structured() && name != "removed") visit(value);
    }
  };
  json tree = json::parse(write_scene(scrambled()));
  for (auto& [name, value] : tree["expect"].items()) value = 1;  // at_least and at_most are explained in the text
  visit(tree);
}

TEST(LimitsReference, IsThePageOfTheDocumentation) {
  const std::string page = read_file(std::string(CUTPROOF_SOURCE_DIR) + "/docs/reference/limits.md", "A page", kMiB);
  EXPECT_EQ(page, limits_reference()) << "Regenerate it: cutproof info --limits > docs/reference/limits.md";
}

TEST(SceneReference, IsThePageOfTheDocumentation) {
  const std::string page = read_file(std::string(CUTPROOF_SOURCE_DIR) + "/docs/reference/scene.md", "A page", kMiB);
  EXPECT_EQ(page, scene_reference()) << "Regenerate it: cutproof info --scene > docs/reference/scene.md";
}

}  // namespace
}  // namespace cutproof::io::scene_io_test
