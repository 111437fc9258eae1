// What `cutproof judge` and `cutproof kick` find in libraries of others (docs/results/libraries.md), by the plugins of
// guests/examples/. Where a library is not installed its tests are skipped, by name.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "fixtures/rotation_answers.h"
#include "guests/guest.h"
#include "guests/questions/campaign.h"
#include "model/at.h"
#include "tests/program.h"

#ifdef CUTPROOF_HAS_BULLET
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#endif

#define NEEDS(example, package)                                                   \
  if (std::string(example).empty()) {                                             \
    GTEST_SKIP() << "built without its library; install " package " and rebuild"; \
  }

namespace libraries_test {
namespace {

using namespace cutproof;
using namespace cutproof::guests;
using nlohmann::json;

class Libraries : public Program {
 protected:
  // The only operation of a plugin, judged: what --json says of it.
  json judged(const std::string& plugin, const std::string& options, int status) const {
    const Outcome outcome = cutproof("judge " + plugin + " --json judged.json " + options);
    EXPECT_EQ(outcome.status, status) << outcome.output;
    const json document = json::parse(read("judged.json"));
    EXPECT_EQ(document.at("holds"), status == 0);
    EXPECT_EQ(document.at("operations").size(), 1u);
    return document.at("operations").at(0);
  }
  static const json& entry(const json& list, const std::string& property) {
    for (const json& each : list) {
      if (each.at("property") == property) return each;
    }
    throw std::logic_error("there is nothing on " + property);
  }
  static void expect_all_judged(const json& operation, const std::vector<std::string>& properties) {
    for (const std::string& property : properties) {
      const json& found = entry(operation.at("properties"), property);
      EXPECT_EQ(found.at("failed"), 0) << found;
      EXPECT_GE(found.at("checked"), 1000) << found;
    }
  }
};

// One matrix as a question: nobody but the judge knows its best rotation.
Question about(const Mat3& a) {
  return {"by hand",
          {make_array("a", {1, 9}, std::vector<double>(a.m.begin(), a.m.end())),
           make_array("previous", {1, 9}, std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1})},
          {make_array("expected", {1}, std::vector<uint8_t>{0})}};
}
Mat3 times(const Mat3& a, double factor) {
  Mat3 product = a;
  for (double& entry : product.m) entry *= factor;
  return product;
}

class Rotations {
 public:
  explicit Rotations(const std::string& plugin) : guest_({plugin, {}}) {}

  Verdict verdict(const Question& question, const std::string& property) {
    for (const Verdict& each : judge_answer(guest_, *find_operation("rotations"), question, true, false)) {
      if (each.property == property) return each;
    }
    throw std::logic_error("no verdict on " + property);
  }
  // Names of the kinds of questions in which a property fails, of `rounds` questions each; only of matrices whose
  // determinant is positive, of which a polar decomposition is a rotation, if so wanted.
  std::vector<std::string> failing_kinds(const std::string& property, int64_t rounds, bool positive) {
    const OperationDescription& operation = *find_operation("rotations");
    const std::vector<std::string> kinds = operation.kinds();
    const auto count = static_cast<int64_t>(kinds.size());
    std::vector<std::string> failing;
    for (int64_t kind = 0; kind < count; ++kind) {
      bool fails = false;
      for (int64_t round = 0; round < rounds && !fails; ++round) {
        Question question = operation.draw(1, kind + count * round, guest_.plugin().precision);
        if (positive) question = with_positive_determinant(question);
        fails = question.given[0].rows() > 0 && !verdict(question, property).holds;
      }
      if (fails) failing.push_back(kinds[at(kind)].substr(0, kinds[at(kind)].find(':')));
    }
    return failing;
  }

 private:
  static Question with_positive_determinant(const Question& question) {
    std::vector<double> a, previous;
    std::vector<uint8_t> expected;
    for (int64_t row = 0; row < question.given[0].rows(); ++row) {
      Mat3 m;
      for (int64_t k = 0; k < 9; ++k) m.m[at(k)] = question.given[0].number(9 * row + k);
      double greatest = 0;
      for (const double each : m.m) greatest = std::max(greatest, std::abs(each));
      // Clearly so: of a matrix that is nearly flat, rounding may choose the sign.
      if (!(fixtures::determinant(times(m, 1 / greatest)) > 1e-3)) continue;
      a.insert(a.end(), m.m.begin(), m.m.end());
      for (int64_t k = 0; k < 9; ++k) previous.push_back(question.given[1].number(9 * row + k));
      expected.push_back(question.known[0].of<uint8_t>()[at(row)]);
    }
    const auto rows = static_cast<int64_t>(expected.size());
    return {question.kind,
            {make_array("a", {rows, 9}, a), make_array("previous", {rows, 9}, previous)},
            {make_array("expected", {rows}, expected)}};
  }
  Guest guest_;
};

// --- Eigen -----------------------------------------------------------------------------------------------------------

class OfEigen : public Libraries, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(, OfEigen,
                         testing::Values(EXAMPLE_eigen_svd_float, EXAMPLE_eigen_svd_double,
                                         EXAMPLE_eigen_transform_float, EXAMPLE_eigen_transform_double),
                         [](const auto& test) {
                           std::string name = files::path(test.param).stem();
                           std::erase(name, '_');
                           return name;
                         });

TEST_P(OfEigen, HoldsExceptOfDenormals) {
  const json found = judged(GetParam(), "", 1);
  expect_all_judged(found, {"rotation"});
  ASSERT_EQ(found.at("failures").size(), 1u) << found;
  const json& failure = found.at("failures")[0];
  EXPECT_EQ(failure.at("property"), "best rotation");
  EXPECT_EQ(failure.at("kind"), "denormals: entries below the least normal number");
  EXPECT_TRUE(failure.at("shrunk").get<std::string>().starts_with("1 of 1 wrong; matrix 0: tr(RᵀA) is 0."));
  // The saved matrix fails again, by itself.
  const Outcome again =
      cutproof("judge " + std::string(GetParam()) + " --case " + failure.at("file").get<std::string>());
  EXPECT_EQ(again.status, 1) << again.output;

  Rotations rotations(GetParam());
  EXPECT_EQ(rotations.failing_kinds("best rotation", 12, false), std::vector<std::string>{"denormals"});
}

// The least of what was found: σ = (6.46, 2.45, 1.52) units become (6, 2, 2) before they are sorted, so the last column
// need not be that of the least, and turning it back is no longer the best.
TEST_P(OfEigen, SortsSingularValuesOfDenormalsAfterRounding) {
  const Mat3 in_float = {{2, 0, 0, 1, -3, 4, 2, 0, 4}}, in_double = {{-4, -1, -2, 0, 0, -4, 0, 3, 1}};
  const bool single = std::string(GetParam()).find("float") != std::string::npos;
  const Mat3& a = single ? in_float : in_double;
  const double least = single ? std::numeric_limits<float>::denorm_min() : std::numeric_limits<double>::denorm_min();
  Rotations rotations(GetParam());
  const Verdict wrong = rotations.verdict(about(times(a, least)), "best rotation");
  EXPECT_FALSE(wrong.holds);
  EXPECT_TRUE(wrong.witness.text.starts_with(single ? "1 of 1 wrong; matrix 0: tr(RᵀA) is 0.18 of Σσ below the best"
                                                    : "1 of 1 wrong; matrix 0: tr(RᵀA) is 0.068 of Σσ below the best"))
      << wrong.witness.text;
  EXPECT_TRUE(rotations.verdict(about(a), "best rotation").holds);
}

// --- Bullet ----------------------------------------------------------------------------------------------------------

// An orthogonal matrix is what it promises: of det A < 0 that is a reflection, which is no rotation.
TEST_F(Libraries, PolarDecompositionOfBulletMayReflect) {
  NEEDS(EXAMPLE_bullet_polar, "libbullet-dev")
  const json found = judged(EXAMPLE_bullet_polar, "", 1);
  ASSERT_EQ(found.at("failures").size(), 2u) << found;
  EXPECT_EQ(found.at("failures")[0].at("property"), "rotation");
  const std::string simplified = found.at("failures")[0].at("shrunk");
  EXPECT_TRUE(simplified.starts_with("1 of 1 wrong; matrix 0: a reflection. A = [")) << simplified;
  EXPECT_EQ(found.at("failures")[1].at("property"), "best rotation");

  Rotations rotations(EXAMPLE_bullet_polar);
  const Verdict mirrored = rotations.verdict(about({{1, 0, 0, 0, 1, 0, 0, 0, -0.5}}), "rotation");
  EXPECT_TRUE(mirrored.witness.text.starts_with("1 of 1 wrong; matrix 0: a reflection. A = [1 0 0; 0 1 0; 0 0 -0.5]"))
      << mirrored.witness.text;
  // What is not orthogonal at all is not called a reflection.
  const Verdict tiny = rotations.verdict(about({{1e-9, 0, 0, 0, 1e-9, 0, 0, 0, -1e-9}}), "rotation");
  EXPECT_TRUE(tiny.witness.text.starts_with("1 of 1 wrong; matrix 0: ‖RᵀR - I‖ = 1.7")) << tiny.witness.text;
}

// It gives up where ‖A‖₁ ‖A‖∞ < 2⁻²³, or that of the inverse is, and then returns A.
TEST_F(Libraries, PolarDecompositionOfBulletHasAScale) {
  NEEDS(EXAMPLE_bullet_polar, "libbullet-dev")
  Rotations rotations(EXAMPLE_bullet_polar);
  const auto off = [&](double scale) {
    return rotations.verdict(about(times({{1, 0, 0, 0, 0, -1, 0, 1, 0}}, scale)), "rotation").measured;
  };
  // ‖A‖₁ ‖A‖∞ = scale². 2⁻¹¹ squared is above 2⁻²³, 2⁻¹² squared below; the inverse likewise.
  for (int k = -11; k <= 11; ++k) EXPECT_LE(off(std::exp2(k)), 5e-6) << "2^" << k;
  for (const int k : {-12, -16, -20, -24, -40, -80}) EXPECT_NEAR(off(std::exp2(k)), std::sqrt(3.0), 1e-3) << "2^" << k;
  for (const int k : {12, 16, 20}) EXPECT_NEAR(off(std::exp2(k)) / std::exp2(2 * k), std::sqrt(3.0), 1e-3) << "2^" << k;
}

// Of matrices of which it would be a rotation: those of all sizes, and moments of tissue among them.
TEST_F(Libraries, PolarDecompositionOfBulletIsNoneOfMomentsInSiUnits) {
  NEEDS(EXAMPLE_bullet_polar, "libbullet-dev")
  Rotations rotations(EXAMPLE_bullet_polar);
  const std::vector<std::string> of_any_size = {"scale_1e-30", "scale_1e30", "scale_any",
                                                "denormals",   "scaled",     "si_moments"};
  EXPECT_EQ(rotations.failing_kinds("rotation", 3, true), of_any_size);
  // 27 particles of 1 kg at distances of h: A = 18 kg h² at rest. Its norm falls below 2^-11.5 at h = 4.38 mm.
  const auto at_rest = [&](double h) { return rotations.verdict(about(times(Mat3{}, 18 * h * h)), "rotation"); };
  EXPECT_TRUE(at_rest(4.4e-3).holds);
  EXPECT_TRUE(at_rest(4.3e-3).witness.text.starts_with(
      "1 of 1 wrong; matrix 0: ‖RᵀR - I‖ = 1.7 (NaN: not finite, or not written). A = [0.00033282"))
      << at_rest(4.3e-3).witness.text;
}

class OfBullet : public Libraries {
 protected:
  void simulate(const std::string& what, const std::string& how, const std::string& name) const {
    const std::string words = what + " " + how + " '" + path(name) + "'";
    EXPECT_EQ(std::system(("'" EXAMPLE_bullet_soft_body "' " + words).c_str()), 0) << words;
  }
  json kicked(const std::string& kMT, int status) const {
    simulate("kick", kMT, "kick.npz");
    const Outcome outcome = cutproof("kick kick.npz --json kick.json");
    EXPECT_EQ(outcome.status, status) << outcome.output;
    return json::parse(read("kick.json"));
  }
};

TEST_F(OfBullet, PieceFeelsTheKickOfTheOther) {
  NEEDS(EXAMPLE_bullet_soft_body, "libbullet-dev")
  const json found = kicked("0.2", 1);
  EXPECT_EQ(found.at("repeats"), true);
  const json& pieces = found.at("kicks").at(0).at("pieces");
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].at("felt"), 116);
  EXPECT_EQ(pieces[1].at("particles"), 103);
  EXPECT_EQ(pieces[1].at("felt"), 103);
  EXPECT_EQ(pieces[1].at("first_frame"), 10) << "the frame of the kick";
  EXPECT_GT(pieces[1].at("greatest"), 0.5);
  const json& verdict = entry(found.at("verdicts"), "no ghost force");
  EXPECT_EQ(verdict.at("holds"), false);
  const std::string witness = verdict.at("witness").at("text");
  EXPECT_NE(
      witness.find("103 of 103 particles of piece 7 move because piece 0 was kicked, to which they are not connected"),
      std::string::npos)
      << witness;
}

TEST_F(OfBullet, PieceFeelsNothingWithoutACommonShape) {
  NEEDS(EXAMPLE_bullet_soft_body, "libbullet-dev")
  const json found = kicked("0", 0);
  const json& pieces = found.at("kicks").at(0).at("pieces");
  EXPECT_EQ(pieces[0].at("felt"), 116);
  EXPECT_EQ(pieces[1].at("particles"), 103);
  EXPECT_EQ(pieces[1].at("felt"), 0);
}

// What couples nodes of a sheet that is cut, and the properties of its run that fail.
struct CutSheet {
  const char* coupling;
  std::vector<std::string> failing;
};
class OfBulletRun : public OfBullet, public testing::WithParamInterface<CutSheet> {};
INSTANTIATE_TEST_SUITE_P(, OfBulletRun,
                         testing::Values(CutSheet{"links", {}}, CutSheet{"shape", {"no coupling across pieces"}},
                                         CutSheet{"clusters_after", {"no coupling across pieces"}},
                                         CutSheet{"clusters_before", {"run well formed"}}),
                         [](const auto& test) { return std::string(test.param.coupling); });

TEST_P(OfBulletRun, FailsWhereSomethingGoesAcrossTheCut) {
  NEEDS(EXAMPLE_bullet_soft_body, "libbullet-dev")
  simulate("run", GetParam().coupling, "run");
  const Outcome outcome = cutproof("check run --json run.json");
  EXPECT_EQ(outcome.status, GetParam().failing.empty() ? 0 : 1) << outcome.output;
  const json found = json::parse(read("run.json"));
  std::vector<std::string> judged, failing;
  for (const json& verdict : found.at("verdicts")) {
    judged.push_back(verdict.at("property"));
    if (!verdict.at("holds")) failing.push_back(verdict.at("property"));
  }
  EXPECT_EQ(failing, GetParam().failing) << outcome.output;
  if (failing == std::vector<std::string>{"run well formed"}) return;  // nothing else means anything
  EXPECT_EQ(found.at("pieces").at("sizes"), json({91, 78}));
  for (const char* const property : {"pieces coupled within", "linear momentum", "centre of mass", "mass kept"}) {
    EXPECT_NE(std::find(judged.begin(), judged.end(), property), judged.end()) << property;
  }
}

#ifdef CUTPROOF_HAS_BULLET
std::unique_ptr<btSoftBody> sheet(btSoftBodyWorldInfo& world) {
  return std::unique_ptr<btSoftBody>(
      btSoftBodyHelpers::CreatePatch(world, {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, 13, 13, 0, true));
}
struct Plane : btSoftBody::ImplicitFn {
  btScalar Eval(const btVector3& place) override { return place.x() - btScalar(0.07); }
};
#endif

// Nodes that a cut adds make the array move: who pointed into it points into memory that was freed.
TEST_F(OfBullet, ClustersMadeBeforeACutPointOutsideTheNodes) {
#ifndef CUTPROOF_HAS_BULLET
  NEEDS("", "libbullet-dev")
#else
  btSoftBodyWorldInfo world;
  const auto body = sheet(world);
  body->generateClusters(8);
  const auto members_outside = [&] {
    int inside = 0, outside = 0;
    for (int c = 0; c < body->m_clusters.size(); ++c) {
      for (int k = 0; k < body->m_clusters[c]->m_nodes.size(); ++k) {
        const btSoftBody::Node* const node = body->m_clusters[c]->m_nodes[k];
        const btSoftBody::Node* const first = &body->m_nodes[0];
        ++(node >= first && node < first + body->m_nodes.size() ? inside : outside);
      }
    }
    return std::pair(inside, outside);
  };
  const auto [members, none] = members_outside();
  EXPECT_GT(members, 169);
  EXPECT_EQ(none, 0);
  Plane plane;
  body->refine(&plane, 0.001f, true);
  EXPECT_EQ(members_outside(), std::pair(0, members));
#endif
}

TEST_F(OfBullet, ShapeMadeBeforeACutHasFewerEntriesThanThereAreNodes) {
#ifndef CUTPROOF_HAS_BULLET
  NEEDS("", "libbullet-dev")
#else
  btSoftBodyWorldInfo world;
  const auto body = sheet(world);
  body->setPose(false, true);
  Plane plane;
  body->refine(&plane, 0.001f, true);
  EXPECT_EQ(body->m_pose.m_pos.size(), 169);
  EXPECT_EQ(body->m_nodes.size(), 219);
#endif
}

// Tissue that is under tension when it is cut does not retract.
TEST_F(OfBullet, CutMakesTheLengthsOfThatMomentThoseAtRest) {
#ifndef CUTPROOF_HAS_BULLET
  NEEDS("", "libbullet-dev")
#else
  btSoftBodyWorldInfo world;
  world.m_gravity.setZero();
  const auto body = sheet(world);
  const auto stretch = [&] {
    float rest = 0, length = 0;
    for (int k = 0; k < body->m_links.size(); ++k) {
      const btSoftBody::Link& link = body->m_links[k];
      rest += link.m_rl;
      length += (link.m_n[0]->m_x - link.m_n[1]->m_x).length();
    }
    return length / rest;
  };
  body->predictMotion(1 / 60.f);
  for (int i = 0; i < body->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body->m_nodes[i];
    node.m_x.setX(1.5f * node.m_x.x());
    node.m_q = node.m_x;
  }
  body->predictMotion(1 / 60.f);
  EXPECT_GT(stretch(), 1.25f);
  Plane plane;
  body->refine(&plane, 0.001f, true);
  body->predictMotion(1 / 60.f);
  EXPECT_NEAR(stretch(), 1, 1e-5);
#endif
}

TEST_F(OfBullet, BallOfTwoCentimetresHasNoRotation) {
#ifndef CUTPROOF_HAS_BULLET
  NEEDS("", "libbullet-dev")
#else
  const auto stretch = [](float radius) {
    btSoftBodyWorldInfo world;
    const std::unique_ptr<btSoftBody> ball(
        btSoftBodyHelpers::CreateEllipsoid(world, {0, 0, 0}, {radius, radius, radius}, 200));
    ball->m_cfg.kMT = 0.2f;
    ball->setPose(false, true);
    ball->rotate(btQuaternion({0, 1, 0}, 0.5f));
    ball->predictMotion(1 / 60.f);
    return ball->m_pose.m_rot.getColumn(0).length();
  };
  EXPECT_NEAR(stretch(1), 1, 1e-4);
  EXPECT_NEAR(stretch(0.03f), 1, 1e-4);
  EXPECT_LT(stretch(0.02f), 1e-3);
#endif
}

// --- Boost.Graph -----------------------------------------------------------------------------------------------------

TEST_F(Libraries, ConnectedComponentsOfBoostHold) {
  expect_all_judged(judged(EXAMPLE_boost_connected_components, "", 0), {"components"});
}
TEST_F(Libraries, DisjointSetsOfBoostHold) {
  expect_all_judged(judged(EXAMPLE_boost_disjoint_sets, "", 0), {"components"});
}

// --- VTK -------------------------------------------------------------------------------------------------------------

class OfVtk : public Libraries, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(, OfVtk,
                         testing::Values("marching_cubes", "flying_edges", "discrete_marching_cubes",
                                         "discrete_flying_edges"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(OfVtk, SurfacesHold) {
  NEEDS(EXAMPLE_vtk_surface, "VTK 9.1 (ci/install.sh libraries)")
  const json found = judged(EXAMPLE_vtk_surface, std::string("--parameters ") + GetParam(), 0);
  expect_all_judged(found, {"surface vertices", "surface", "surface shells"});
}

// With tissue and what is around it exchanged they join what meets across the diagonal of a face, everywhere.
TEST_P(OfVtk, ExchangedTheyHaveTheOtherPolarity) {
  NEEDS(EXAMPLE_vtk_surface, "VTK 9.1 (ci/install.sh libraries)")
  const json found =
      judged(EXAMPLE_vtk_surface, std::string("--parameters ") + GetParam() + "_exchanged --cases 200", 1);
  ASSERT_EQ(found.at("failures").size(), 1u) << found;
  EXPECT_EQ(found.at("failures")[0].at("property"), "surface shells");
  const std::string text = found.at("failures")[0].at("shrunk");
  EXPECT_TRUE(text.starts_with("1 outer and 0 inner shells around 2 components with 0 cavities")) << text;
  EXPECT_NE(text.find("It is right in the other polarity (1 components, 0 cavities)"), std::string::npos) << text;
}

// --- CUDA ------------------------------------------------------------------------------------------------------------

class OnTheDevice : public Libraries {
 protected:
  // Status 77 and one line where there is no device.
  bool can_run(const std::string& plugin) const {
    const Outcome outcome = cutproof("judge " + plugin + " --cases 1");
    if (outcome.status != 77) return true;
    EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
    EXPECT_NE(outcome.output.find("it needs a CUDA device"), std::string::npos) << outcome.output;
    return false;
  }
};
#define NEEDS_DEVICE(example)                  \
  NEEDS(example, "a CUDA toolkit")             \
  if (!can_run(example)) {                     \
    GTEST_SKIP() << "there is no CUDA device"; \
  }

TEST_F(OnTheDevice, LabelsThatSpreadHold) {
  NEEDS_DEVICE(EXAMPLE_cuda_components)
  expect_all_judged(judged(EXAMPLE_cuda_components, "", 0), {"components"});
}
TEST_F(OnTheDevice, LabelsInABlockHold) {
  NEEDS_DEVICE(EXAMPLE_cuda_components_in_a_block)
  expect_all_judged(judged(EXAMPLE_cuda_components_in_a_block, "", 0), {"components"});
}
TEST_F(OnTheDevice, LabelsInABlockWithoutABarrierAreFound) {
  NEEDS_DEVICE(EXAMPLE_cuda_components_without_barrier)
  const json found = judged(EXAMPLE_cuda_components_without_barrier, "", 1);
  ASSERT_EQ(found.at("failures").size(), 1u) << found;
  EXPECT_EQ(found.at("failures")[0].at("property"), "components");
}
TEST_F(OnTheDevice, TwentyTurnsAreNotAlwaysEnough) {
  NEEDS_DEVICE(EXAMPLE_cuda_rotations)
  const json found = judged(EXAMPLE_cuda_rotations, "", 1);
  EXPECT_GT(entry(found.at("properties"), "best rotation").at("failed"), 0);
}

}  // namespace
}  // namespace libraries_test
