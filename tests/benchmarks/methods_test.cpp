// Table 3 of `cutproof bench baselines`: the kidney for all methods, and what each figure of a row says.
#include "benchmarks/methods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "model/at.h"
#include "model/error.h"
#include "tests/program.h"

namespace cutproof::benchmarks::methods_test {
namespace {

using nlohmann::json;

constexpr double kModulus = 1e4;
const Kidney& kidney() {
  static const Kidney kKidney = make_kidney(600, kModulus);
  return kKidney;
}

// Not a simulator: tissue is stretched from the first frame on, and what is kicked flies on. The others feel `felt` of
// it, all edges couple, and from the middle on the last particle is gone.
class Stretched : public Method {
 public:
  explicit Stretched(double by, double felt = 0) : by_(by), felt_(felt) {}
  std::string name() const override { return "stretched"; }
  std::string source() const override { return ""; }
  std::string settings() const override { return ""; }
  MethodRun run(const Kidney& kidney, int64_t frames, const MethodKick* kick) override {
    const guests::scenes::Scene& scene = kidney.scene;
    const int64_t n = scene.count();
    MethodRun run;
    for (int64_t f = 0; f < frames; ++f) {
      std::vector<Vec3> x = scene.rest;
      for (Vec3& each : x) each = each * (f == 0 ? 1 : 1 + by_);
      if (kick != nullptr && f >= kick->frame) {
        const Vec3 way = kick->velocity * (scene.frame_time * static_cast<double>(f - kick->frame + 1));
        for (Vec3& each : x) each += way * felt_;
        for (const int32_t i : kick->particles) x[at(i)] += way * (1 - felt_);
      }
      Arrays& arrays = run.frames.emplace_back().arrays;
      arrays.push_back(make_array("positions", {1, n, 3}, guests::scenes::numbers_of(x)));
      arrays.push_back(make_array("time", {1}, std::vector<double>{static_cast<double>(f) * scene.frame_time}));
      std::vector<uint8_t> alive(at(n), 1);
      alive.back() = f < frames / 2;
      arrays.push_back(make_array("alive", {1, n}, alive));
      const auto quad = std::span(scene.blade).subspan(at(4 * f), 4);
      if (std::isfinite(quad.front().x)) {
        arrays.push_back(make_array("blade", {1, 1, 4, 3}, guests::scenes::numbers_of({quad.begin(), quad.end()})));
      }
      if (f > 0) {
        run.seconds.push_back(0.004);
        continue;
      }
      std::vector<int32_t> edges;
      std::vector<int64_t> offsets = {0};
      for (const auto& [a, b] : scene.edges) {
        edges.insert(edges.end(), {a, b});
        offsets.push_back(std::ssize(edges));
      }
      arrays.push_back(make_array("rest", {n, 3}, guests::scenes::numbers_of(scene.rest)));
      arrays.push_back(make_array("mass", {n}, scene.mass));
      arrays.push_back(make_array("spacing", {1}, std::vector<double>{scene.h}));
      arrays.push_back(make_array("edges", {std::ssize(scene.edges), 2}, edges));
      arrays.push_back(make_array("groups_offsets", {std::ssize(offsets)}, offsets));
      arrays.push_back(make_array("groups_members", {std::ssize(edges)}, edges));
    }
    return run;
  }

 private:
  double by_, felt_;
};

TEST(Kidneys, AreOfOneMaterialWhateverTheirSizes) {
  const Kidney finer = make_kidney(2000, kModulus);
  for (const Kidney* each : {&kidney(), &finer}) {
    const double h = each->setup.body.grid.spacing, k = each->setup.step.stiffness;
    EXPECT_NEAR(0.5 * 1000 * k * 5 * h * h, kModulus, 1e-9 * kModulus);
    EXPECT_EQ(each->scene.count(), each->setup.body.particle_count());
    EXPECT_GT(each->uncut, 10);
    EXPECT_GT(each->last_cut, each->uncut);
    EXPECT_LT(each->last_cut + 2, each->scene.frames);
    EXPECT_GT(std::count(each->scene.held.begin(), each->scene.held.end(), 1), 0);
    std::vector<uint8_t> is_corner(each->scene.rest.size(), 0);
    for (const int32_t i : each->scene.hexahedra) is_corner[at(i)] = 1;
    EXPECT_EQ(std::count(is_corner.begin(), is_corner.end(), 0), 0);
  }
  EXPECT_LT(finer.setup.body.grid.spacing, kidney().setup.body.grid.spacing);
}

// Between strokes nothing is swept; within one, each patch covers the last frame's once more.
TEST(Kidneys, AreCutAlongOneSurfaceAStroke) {
  const std::vector<Vec3>& blade = kidney().scene.blade;
  int64_t strokes = 0, swept = 0;
  for (int64_t f = 2; f < kidney().scene.frames; ++f) {
    if (!std::isfinite(blade[at(4 * f)].x)) continue;
    ++swept;
    const bool is_first = !std::isfinite(blade[at(4 * f - 4)].x);
    strokes += is_first;
    if (is_first) continue;
    const bool is_second = !std::isfinite(blade[at(4 * f - 8)].x);
    const std::size_t begin = is_second ? at(4 * f - 4) : at(4 * f - 5);  // of the frame before: its begin, or the end
                                                                          // of the one before that
    EXPECT_LT(norm(blade[at(4 * f)] - blade[begin]), 1e-12) << f;
    const Vec3 way = blade[at(4 * f + 3)] - blade[at(4 * f)], along = blade[at(4 * f + 1)] - blade[at(4 * f)];
    EXPECT_LT(std::abs(dot(way, along)), 1e-9 * norm(way) * norm(along)) << f;
  }
  EXPECT_EQ(strokes, 2);
  EXPECT_GT(swept, 20);
}

TEST(Kidneys, OfAConvergedSolutionAreInterpolatedBetweenItsNodes) {
  Stretched method(0.02);
  const ConvergedKidney truth(method, 2000, kModulus);
  const Body& body = kidney().setup.body;
  int64_t inside = 0;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 world = body.orientation * body.rest_position(i) + body.origin;
    const std::optional<Vec3> found = truth.at_rest_place(world);
    if (!found) continue;
    ++inside;
    // Linear fields are reproduced, up to where the finer kidney's frame begins.
    const Vec3 next = *truth.at_rest_place(world + Vec3{1e-4, 0, 0});
    EXPECT_NEAR(next.x - found->x, 2e-6, 1e-12);
    EXPECT_NEAR(next.y - found->y, 0, 1e-12);
  }
  EXPECT_GT(inside, body.particle_count() / 2);
}

TEST(MethodRows, TellWhatTheRunWasLike) {
  Stretched method(0.02, 0.01), right(0.01);
  // Its own kidney as the truth: places at rest are its nodes.
  const ConvergedKidney truth(right, 600, kModulus);
  const json row = row_of(method, kidney(), &truth, true);
  EXPECT_TRUE(row.at("refused").is_null());
  EXPECT_NEAR(row.at("error").at("rms").get<double>(), 1, 1e-9) << "twice as far as it should be";
  EXPECT_NEAR(row.at("seconds_per_second").get<double>(), 0.25, 1e-12);
  EXPECT_NEAR(row.at("lost").get<double>(), 1.0 / static_cast<double>(kidney().scene.count()), 1e-12);
  EXPECT_GE(row.at("pieces").at("at_least"), 2);
  EXPECT_EQ(row.at("pieces").at("coupled"), 1);
  EXPECT_NEAR(row.at("felt").at("withdrawn").get<double>(), 0.01, 1e-9);
  EXPECT_NEAR(row.at("felt").at("blade_in").get<double>(), 0.01, 1e-9);
  EXPECT_TRUE(row.at("spin_kept").is_null()) << "it tells no velocities";
  const auto fails = row.at("fails").get<std::vector<std::string>>();
  EXPECT_NE(std::find(fails.begin(), fails.end(), "no coupling across pieces"), fails.end());
}

TEST(MethodRows, OfThisMethodHold) {
  const auto method = make_own_method("reference", baselines().front(), 8);
  const json row = row_of(*method, kidney(), nullptr, true);
  EXPECT_EQ(row.at("fails"), json::array());
  EXPECT_EQ(row.at("felt").at("withdrawn"), 0.0);
  EXPECT_EQ(row.at("pieces").at("coupled"), 2);
  EXPECT_GT(row.at("lost"), 0);
  EXPECT_TRUE(row.at("error").is_null());
  // Implicit steps lose some of it.
  EXPECT_GT(row.at("spin_kept"), 0.5);
  EXPECT_LT(row.at("spin_kept"), 1);
}

TEST(MethodRows, OfAnotherRuleShowItsFault) {
  const auto method = make_own_method("reference", baselines()[1], 8);  // particles deleted, no split
  const json row = row_of(*method, kidney(), nullptr, true);
  EXPECT_GT(row.at("felt").at("withdrawn").get<double>(), 1e-3) << "clusters still reach across the cut";
}

TEST(PluginMethods, AreAskedLikeAnyOther) {
  const auto method = make_plugin_method(CUTPROOF_PLUGIN_OF_SPRINGS);
  const json row = row_of(*method, kidney(), nullptr, true);
  EXPECT_TRUE(row.at("refused").is_null()) << row.at("refused");
  EXPECT_TRUE(row.at("timed_by_judge"));
  // Springs along edges bear no shear: the kidney hangs below the blade, and nothing is cut off.
  EXPECT_EQ(row.at("fails"), json::array({"something was cut"}));
  EXPECT_TRUE(row.at("felt").at("withdrawn").is_null());
  EXPECT_NEAR(row.at("spin_kept").get<double>(), 1, 1e-12);
  EXPECT_THROW(make_plugin_method(CUTPROOF_PLUGIN_OF_WHOLE_FRAMES), InputError) << "it has no dissect";
  EXPECT_THROW(make_plugin_method("/nowhere.so"), InputError);
}

}  // namespace
}  // namespace cutproof::benchmarks::methods_test
