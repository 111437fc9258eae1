// `cutproof bench material`: what bars have is what their material says, where clusters are small beside the bar.
#include "benchmarks/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "benchmarks/suites/suites.h"
#include "harness/backends.h"
#include "model/error.h"

namespace cutproof::benchmarks::material_test {
namespace {

struct Bar {
  std::unique_ptr<Backend> backend = harness::make_backend({"host"});
  MaterialBar bar;
  explicit Bar(const BarSpec& spec) : bar(*backend, spec) {}
  MaterialBar* operator->() { return &bar; }
};

// Cubes that tile hang as the formula of the method says, but where the bar is held.
TEST(MaterialBars, HaveTheModuliOfTheirMaterial) {
  for (const double nu : {0.0, 0.3, 0.45}) {
    Bar bar({.side = 2, .poisson_ratio = nu, .across = 6});
    const std::vector<MaterialFigure> hung = bar->hang();
    EXPECT_NEAR(hung.at(0).measured / hung.at(0).asked, 1, nu == 0 ? 1e-3 : 0.12) << nu;
    EXPECT_NEAR(hung.at(1).measured, nu, 0.02);
    const MaterialFigure volume = bar->pull();
    EXPECT_NEAR(volume.measured, volume.asked, 0.01) << nu;
    EXPECT_NEAR(volume.asked, nu == 0 ? 1.2 : nu == 0.3 ? 1.075 : 1.02, 0.01);
  }
}

TEST(MaterialBars, SwingAndDecayAsTheyShould) {
  // Irregular covers are stiffer.
  for (const std::string along : {"100", "110", "111"}) {
    Bar bar({.along = along, .side = 2, .across = 8});
    for (const MaterialFigure& one : {bar->swing_along(), bar->swing_across()}) {
      EXPECT_GT(one.measured / one.asked, 0.95) << along << " " << one.test;
      EXPECT_LT(one.measured / one.asked, along == "100" ? 1.05 : 1.5) << along << " " << one.test;
    }
    const MaterialFigure decay = bar->decay();
    EXPECT_NEAR(decay.measured / decay.asked, 1, 0.02) << along;
  }
}

// A twist is not affine within a cluster, so k resists it: the more, the fewer clusters lie across. Turn this round
// when clusters follow it.
TEST(KnownGap, BarsTwistTooStifflyWhereFewClustersLieAcross) {
  const auto excess = [](int32_t across, double nu) {
    Bar bar({.side = 2, .poisson_ratio = nu, .across = across});
    const MaterialFigure twist = bar->twist();
    return twist.measured / twist.asked - 1;
  };
  const double coarse = excess(6, 0), fine = excess(12, 0);
  EXPECT_GT(fine, 0.05);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.5);
  EXPECT_GT(excess(6, 0.45), 5 * coarse);
}

TEST(MaterialBars, AreSofterAfterFewIterations) {
  double last = 0;
  for (const int32_t iterations : {1, 2, 4}) {
    Bar bar({.side = 2, .across = 6, .iterations = iterations});
    const MaterialFigure one = bar->swing_along();
    EXPECT_NEAR(one.measured / one.asked, 1, 0.05) << iterations;
    EXPECT_GT(one.asked, last);
    last = one.asked;
  }
  EXPECT_LT(last, 0.99e4);
}

TEST(MaterialBars, AreRowsOfTheSuite) {
  MaterialOptions options{.backend = "host", .sides = {2}, .poisson_ratios = {0.3}, .across = {4}, .iterations = {2}};
  const nlohmann::json document = run_material(options, [](const nlohmann::json&) {});
  EXPECT_EQ(document.at("rows").size(), document.at("rows_at_most"));
  options.sides = {20};
  EXPECT_THROW(run_material(options, [](const nlohmann::json&) {}), InputError) << "one cluster";
  options.along = {"101"};
  try {
    run_material(options, [](const nlohmann::json&) {});
    FAIL() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'101' is no axis of a bar"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace cutproof::benchmarks::material_test
