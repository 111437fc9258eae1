#include "oracles/step_model/step_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "model/at.h"
#include "oracles/best_rotation.h"
#include "oracles/contact.h"
#include "oracles/eigen.h"
#include "oracles/memberships.h"
#include "oracles/noise.h"
#include "oracles/rest_places.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"
#include "oracles/volume_target.h"

namespace cutproof::oracles {
namespace {

// Rounding of single operations, in units of u times their operands (tolerances.md, The step again).
constexpr double kRotationRounds = 4;   // a rotation, about each axis, given its matrix
constexpr double kParameterRounds = 4;  // constants from parameters: s, e^(-c dt), Chebyshev's weights
// Equal numbers that round alike are equal within so many roundings: earlier roundings make them differ.
constexpr double kAlikeRounds = 256;
// How much ways into the blade's frame and back round, in units of u times the distance from its edge.
constexpr double kContactRounds = 4;
// Within this many roundings of that distance, the side of a border is not known.
constexpr double kNearRounds = 32;

// Up to so many times what the rounding of places makes of the matrix, it says nothing of how a cluster is turned.
constexpr double kLost = 100;
// Less than this of the previous rotation is nothing to go by, in whatever precision (the reference takes 1e-9), nor so
// many roundings.
constexpr double kHalfTurn = 1e-8, kHalfTurnRounds = 1e4;

constexpr Mat3 kNoTerms = {{0, 0, 0, 0, 0, 0, 0, 0, 0}};

Vec3 turned_by(Vec3 rotation_vector, Vec3 v) { return v + cross(rotation_vector, v); }

// Weights of Chebyshev's iteration j -> j + 1 by the ratio of Chebyshev polynomials (method.md §11): ω_j+1 =
// 2 T_j(1/ρ) / (ρ T_j+1(1/ρ)), by the polynomials' own recurrence.
struct ChebyshevWeights {
  double pull = 1, carry = 0;
};
std::vector<ChebyshevWeights> chebyshev_weights(double s, int32_t iterations) {
  const double greatest = std::min(s, 0.95), rho = greatest / (2 - greatest);
  std::vector<ChebyshevWeights> weights(at(std::max(iterations, 1)));
  if (!(rho > 0)) {
    for (std::size_t j = 1; j < weights.size(); ++j) weights[j] = {2 / (2 - greatest), 0};
    return weights;
  }
  // ratio = T_j−1 / T_j at 1 / ρ; both grow fast, their ratio does not.
  double ratio = rho;  // T_0 / T_1
  for (std::size_t j = 1; j < weights.size(); ++j) {
    double omega = 1;
    if (j > 1) {
      const double next = 1 / (2 / rho - ratio);  // T_j−1 / T_j
      omega = 2 / rho * next;
      ratio = next;
    }
    weights[j] = {omega * 2 / (2 - greatest), omega - 1};
  }
  return weights;
}

// a bᵀ
void add_product(Mat3& sum, Vec3 a, Vec3 b) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) sum(row, column) += a[row] * b[column];
  }
}

// Of a matrix of second moments; directions in which there is no extent stay without.
Mat3 pseudoinverse(const Mat3& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(as_eigen(moments));
  const Eigen::Vector3d& values = solver.eigenvalues();
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (values[k] > 1e-9 * values[2]) inverse[k] = 1 / values[k];
  }
  return to_mat3(solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose());
}

}  // namespace

StepModel::StepModel(const Setup& setup, const State& before, double unit_roundoff)
    : setup_(setup), before_(before), u_(unit_roundoff) {
  const Body& body = setup.body;
  const Clusters& clusters = before.clusters;
  const int32_t n = body.particle_count();
  holders_ = membership_counts(clusters, n);
  weight_.resize(at(n));
  lever_.resize(at(n));
  for (int32_t i = 0; i < n; ++i) weight_[at(i)] = holders_[at(i)] > 0 ? body.mass[at(i)] / holders_[at(i)] : 0;
  clusters_.resize(at(clusters.count()));
  arm_.resize(clusters.members.size());
  for (int32_t c = 0; c < clusters.count(); ++c) {
    Cluster& cluster = clusters_[at(c)];
    const auto members = clusters.of(c);
    cluster.begin = clusters.offsets[at(c)];
    cluster.end = clusters.offsets[at(c + 1)];
    cluster.extent = Cluster::Extent::point;
    if (members.empty()) continue;  // coverage rejects it
    const Vec3 base = body.rest_position(members.front());
    Vec3 moment;
    for (const int32_t i : members) {
      cluster.mass += weight_[at(i)];
      moment += weight_[at(i)] * (body.rest_position(i) - base);
    }
    const Vec3 from_base = moment / cluster.mass;
    cluster.rest = base + from_base;
    Mat3 moments = kNoTerms;
    for (std::size_t k = 0; k < members.size(); ++k) {
      Vec3& arm = arm_[at(cluster.begin) + k];
      arm = (body.rest_position(members[k]) - base) - from_base;
      add_product(moments, weight_[at(members[k])] * arm, arm);
      cluster.radius = std::max(cluster.radius, norm(arm));
      cluster.arms += weight_[at(members[k])] * norm(arm);
      lever_[at(members[k])] += dot(arm, arm);
    }
    cluster.moments = moments;
    cluster.inverse = pseudoinverse(moments);
    cluster.extent = members.size() == 1           ? Cluster::Extent::point
                     : is_on_a_line(body, members) ? Cluster::Extent::line
                                                   : Cluster::Extent::more;
  }
  for (int32_t i = 0; i < n; ++i) {
    if (holders_[at(i)] > 0) lever_[at(i)] = std::sqrt(lever_[at(i)]) / holders_[at(i)];
  }
}

std::vector<Vec3> StepModel::without_shared(const std::vector<Vec3>& field) const {
  const Clusters& clusters = before_.clusters;
  std::vector<Vec3> shared(field.size());
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Cluster& cluster = clusters_[at(c)];
    const auto members = clusters.of(c);
    if (members.empty()) continue;
    Vec3 mean;
    Mat3 slope = kNoTerms;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const Vec3 term = weight_[at(members[k])] * field[at(members[k])];
      mean += term / cluster.mass;
      add_product(slope, term, cluster.inverse * arm_[at(cluster.begin) + k]);
    }
    for (std::size_t k = 0; k < members.size(); ++k) {
      const int32_t i = members[k];
      shared[at(i)] += (mean + slope * arm_[at(cluster.begin) + k]) / static_cast<double>(holders_[at(i)]);
    }
  }
  std::vector<Vec3> own(field.size());
  for (std::size_t i = 0; i < field.size(); ++i) own[i] = field[i] - shared[i];
  return own;
}

int64_t StepModel::evaluations() const {
  return (setup_.step.iterations + int64_t{1}) * setup_.step.substeps *
         static_cast<int64_t>(arm_.size() + weight_.size());
}

// One run: the data that change from substep to substep.
class StepModel::Run {
 public:
  Run(const StepModel& model, const Wanted& wanted)
      : model_(model),
        setup_(model.setup_),
        body_(model.setup_.body),
        before_(model.before_),
        wanted_(wanted),
        disturbed_(wanted.disturbance != 0),
        kind_(wanted.disturbance > 0
                  ? static_cast<Kind>(((wanted.disturbance - 1) / 2 + (wanted.disturbance - 1) / 24) % 3)
                  : Kind::independent),
        noise_(wanted.disturbance, kind_ == Kind::alike ? kAlikeRounds * model.u_ : 0),
        lasting_((wanted.disturbance + 1) / 2, wanted.disturbance % 2 == 0 ? -1 : +1),
        lost_(static_cast<Lost>(wanted.disturbance % 4)),
        coordinate_(wanted.disturbance / 4 % 6),
        u_(model.u_),
        draws_(~wanted.disturbance),
        stores_positions_(before_.precision != Precision::binary32) {
    out_.x = before_.x;
    out_.v = before_.v;
    out_.rotation = before_.clusters.rotation;
    out_.rounding.resize(out_.x.size());
    out_.own_rounding.resize(out_.x.size());
    out_.raised.resize(out_.x.size());
    out_.lead.assign(out_.x.size(), std::numeric_limits<double>::infinity());
    out_.hold = out_.lead;
    out_.turn_rounding.resize(model.clusters_.size());
    out_.is_free.assign(model.clusters_.size(), 0);
    sum_.resize(out_.x.size());
    goal_rounding_.resize(out_.x.size());
    if (disturbed_) {
      for (const Cluster& cluster : model.clusters_) {
        rest_off_.push_back(u_ * lasting_.off(stores_positions_ ? cluster.rest : Vec3{}, cluster.radius));
      }
      parameter_off_ = kParameterRounds * u_ * lasting_();
      step_off_ = u_ * lasting_();
      if (setup_.step.retardation > 0) share_off_ = kParameterRounds * u_ * lasting_();
    }
  }

  StepOutcome run() {
    for (int32_t s = 0; s < setup_.step.substeps; ++s) substep(s);
    return std::move(out_);
  }

 private:
  // The number that a backend stores of a place of particle i.
  Vec3 stored(std::size_t i, Vec3 x) const {
    return stored_place(body_, before_.precision, static_cast<int32_t>(i), x);
  }

  std::vector<Wall> walls_now() {
    std::vector<Wall> walls = setup_.walls;
    if (disturbed_) {
      for (Wall& wall : walls) wall.offset += u_ * wall.offset * lasting_();
    }
    return walls;
  }

  BladeMove move_now(const BladeMove& move) {
    if (!disturbed_) return move;
    BladeMove off = move;
    for (BladePose* pose : {&off.from, &off.to}) {
      pose->edge += lasting_.off(u_ * pose->edge, 0);
      const Vec3 turn = (2 * u_) * lasting_.vector();
      pose->along = turned_by(turn, pose->along);
      pose->back = turned_by(turn, pose->back);
    }
    return off;
  }

  void substep(int32_t s);
  void match_shapes(int32_t s, int32_t j);
  // `size`: of all terms of A. `noise`: the error of A from the rounding of places.
  Mat3 rotation_of(int32_t c, const Eigen::Matrix3d& a, double size, double noise, bool is_last);
  Mat3 one_of_many(BestRotation best, const Mat3& previous, bool all);
  bool keeps_rotation();
  // Whether `lead`, of one outcome over another, is above 0; anything where that is drawn. `rounds`: what it rounds
  // [m].
  bool exceeds(std::size_t i, double lead, double rounds) {
    out_.lead[i] = std::min(out_.lead[i], std::max(0.0, std::abs(lead) - rounds));
    return is_drawn(i, lead, rounds) ? draws_() > 0 : lead > 0;
  }
  bool is_drawn(std::size_t i, double lead, double rounds) const {
    return !wanted_.open.empty() && std::abs(lead) <= wanted_.open[i] + rounds;
  }
  // A particle's cluster could be turned in any of many ways.
  void note_open(int32_t c) {
    for (const int32_t i : before_.clusters.of(c)) out_.lead[at(i)] = 0;
  }
  int side_of(std::size_t i, const Contact& contacts, Vec3 start, const BladeMove& move);
  Vec3 placed(std::size_t i, Vec3 free, Vec3 start, const Vec3* present, const Contact& contacts, double& raised);

  // The rounded quantities: of clusters and of particles.
  enum class Rounded : uint8_t { shape, prediction, place, push, end, impulse };
  void round(Rounded what, std::size_t index) {
    noise_.name(static_cast<uint64_t>(what), index, kind_ == Kind::independent ? time_ : 0);
  }

  // How the single roundings of a disturbed run go together, two runs this way, the next two that way: not at all; each
  // is the same in every iteration and substep, as of iterates that hardly change; and equal numbers round alike too,
  // as of a body that falls as a whole, or of the layers of a regular one: what is summed over them grows with their
  // number.
  enum class Kind : uint8_t { independent, repeated, alike };

  // How a disturbed run draws the rotation of a cluster whose matrix is no more than rounding, one run this way, the
  // next that way: the best of that noise; any; the best where places differ in one coordinate alone, as they do on
  // walls, each of six directions in turn; the previous one. Which way a pair falls apart may decide where it ends, and
  // draws of one kind leave out one of the ways. On a line, any turn about it, and every second time what noise makes
  // of it.
  enum class Lost : uint8_t { noise, any, coordinate, kept };

  const StepModel& model_;
  const Setup& setup_;
  const Body& body_;
  const State& before_;
  const Wanted& wanted_;
  const bool disturbed_;
  const Kind kind_;
  Noise noise_;            // of single roundings
  OppositeNoise lasting_;  // of what stays the same throughout a run
  const Lost lost_;
  const std::size_t coordinate_;  // of ±x, ±y, ±z
  const double u_;
  Noise draws_;  // of decisions
  const bool stores_positions_;
  StepOutcome out_;
  std::vector<Vec3> y_;                // [n] where elasticity acts
  std::vector<Vec3> sum_;              // [n] Σ_c t + R (X - T)
  std::vector<double> goal_rounding_;  // [n] Σ_c of squares
  std::vector<double> rounding_now_;   // [n] of this substep
  std::vector<double> own_now_;        // [n] of it, the particle's own
  double shared_rounding_ = 0;         // of this substep, of Σ m goal: of squares
  std::vector<Vec3> rest_off_;         // [m]
  double parameter_off_ = 0, step_off_ = 0, share_off_ = 0;
  double share_ = 1;           // dt / (dt + τ): of the way to y, x has come so far
  double turn_amplitude_ = 0;  // of the last rotation [rad]
  uint64_t time_ = 0;          // evaluations so far
  std::vector<int> sides_;     // [n] of the blade, in this substep
  bool is_last_ = false;       // of its substeps
};

// One of the rotations that take v to u, the nearest to the previous one; any of them in a disturbed run. `all`: of all
// rotations, as this run draws them.
Mat3 StepModel::Run::one_of_many(BestRotation best, const Mat3& previous, bool all) {
  if (all && lost_ == Lost::coordinate) {
    best.u = {0, 0, 0};
    best.u[coordinate_ / 2] = coordinate_ % 2 == 0 ? 1 : -1;
  }
  const Mat3 nearest = nearest_of_rank_one(best, previous).r;
  if (!disturbed_ || (all && (lost_ == Lost::coordinate || lost_ == Lost::noise))) return nearest;
  const Vec3 axis = all ? noise_.vector() : Vec3{best.u[0], best.u[1], best.u[2]};
  const double length = norm(axis);
  if (!(length > 0)) return nearest;
  const Eigen::AngleAxisd turn(std::numbers::pi * noise_(), as_eigen(axis) / length);
  return to_mat3(turn.toRotationMatrix() * as_eigen(nearest));
}

// The best rotation; the previous one where there is no extent, the nearest to it along a line.
Mat3 StepModel::Run::rotation_of(int32_t c, const Eigen::Matrix3d& a, double size, double noise, bool is_last) {
  const Cluster& cluster = model_.clusters_[at(c)];
  const Mat3& previous = out_.rotation[at(c)];
  double& rounding = out_.turn_rounding[at(c)];
  turn_amplitude_ = kRotationRounds * u_;
  rounding = 0;
  if (cluster.extent == Cluster::Extent::point || !a.allFinite() || a.cwiseAbs().maxCoeff() == 0) return previous;
  const double sum_amplitude = sum_rounds(static_cast<double>(cluster.end - cluster.begin)) * u_ * size;
  const bool is_given = is_last && !wanted_.given.empty() && wanted_.given[at(c)] != nullptr;
  if (cluster.extent == Cluster::Extent::line) {
    const BestRotation best = best_rotation(to_mat3(a));
    const NearestRotation nearest = nearest_of_rank_one(best, previous);
    // Near half a turn, what a quaternion has of the previous rotation is short, and its rounding turns it farther;
    // where it is no more than that, every answer is as near as any other.
    const double kept = std::sqrt(nearest.weight);
    const bool is_half_turn = !(kept > std::max(kHalfTurnRounds * u_, kHalfTurn));
    const bool is_lost = !(a.norm() > kLost * noise);
    if (!is_half_turn) turn_amplitude_ /= kept;
    rounding = is_lost ? 1.0 : turn_amplitude_ + sum_amplitude / a.norm();
    rounding *= rounding;
    // How it is turned about itself moves no member; but it stays.
    if (is_half_turn || (is_lost && is_last)) out_.is_free[at(c)] = 1;
    if (is_given) return *wanted_.given[at(c)];
    if (is_half_turn || is_lost) note_open(c);
    if (is_lost && keeps_rotation()) return previous;
    return is_half_turn || is_lost ? one_of_many(best, previous, is_lost) : nearest.r;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  const Eigen::Matrix3d& v = svd.matrixV();
  if (u.determinant() * v.determinant() < 0) u.col(2) *= -1;
  const Eigen::Vector3d sigma = (u.transpose() * a * v).diagonal();
  const double sure = sigma[1] + sigma[2];
  if (!(sure > std::max(degenerate_rounds(u_) * u_ * sigma[0], kLost * noise))) {
    const bool is_lost = !(sigma[0] > kLost * noise);
    if (is_last) out_.is_free[at(c)] = 1;
    rounding = is_lost ? 1.0 : u_ * kRotationRounds + sum_amplitude / sigma[0];
    rounding *= rounding;
    if (is_given) return *wanted_.given[at(c)];
    note_open(c);
    if (is_lost && keeps_rotation()) return previous;
    const BestRotation best = best_rotation(to_mat3(a));
    // What noise alone makes of it, every second time: contacts give that a direction of its own.
    if (disturbed_ && (!is_lost || lost_ == Lost::noise) && noise_() < 0) return to_mat3(u * v.transpose());
    return one_of_many(best, previous, is_lost);
  }
  rounding = u_ * kRotationRounds + std::min(1.0, std::sqrt(2.0) * sum_amplitude / sure);
  rounding *= rounding;
  if (is_given) return *wanted_.given[at(c)];
  return to_mat3(u * v.transpose());
}

// Whether a cluster whose matrix is no more than rounding keeps its rotation, as it does where a backend finds nothing
// but zeros: among all rotations that is one which no draw at random finds.
bool StepModel::Run::keeps_rotation() {
  if (!disturbed_ || lost_ == Lost::coordinate) return false;
  return lost_ == Lost::kept || noise_() > 0;
}

// On which side of the blade a particle begins the substep, +1 or -1.
int StepModel::Run::side_of(std::size_t i, const Contact& contacts, Vec3 start, const BladeMove& move) {
  double height = contacts.height_at_start(start);
  const double distance = u_ * norm(start - move.from.edge), rounds = kNearRounds * distance;
  if (disturbed_) height += kContactRounds * distance * noise_();
  const int seen = wanted_.side_of_end.empty() ? 0 : wanted_.side_of_end[i];
  if (seen != 0 && (std::abs(height) <= rounds || is_drawn(i, height, rounds))) {
    // For the last substep that is certain, and for earlier ones likely.
    if (!is_last_) out_.lead[i] = 0;
    if (is_last_ || wanted_.open.empty()) return seen;
  }
  return exceeds(i, -height, rounds) ? -1 : +1;
}

// Where contacts put a particle that would go to `free`. `present`: where it is, which it does not leave for what is
// worse; nullptr: the prediction, which comes from nowhere. `raised`: by how much the square of its distance from where
// it would go has grown [m²].
Vec3 StepModel::Run::placed(std::size_t i, Vec3 free, Vec3 start, const Vec3* present, const Contact& contacts,
                            double& raised) {
  Contact::Found found;
  Contact::Rounding rounding;
  if (disturbed_) {
    rounding.near = kContactRounds * u_ * contacts.rounds(free);
    rounding.on_borders = wanted_.disturbance % 2 == 0;
    rounding.between_turns = rounding.on_borders ? nullptr : &noise_;
  }
  if (!wanted_.open.empty() && wanted_.open[i] >= 0) {
    rounding.near += wanted_.open[i];
    rounding.preferred_way =
        std::min(static_cast<int>((draws_() + 1) / 2 * Contact::kWaysOffPlate), Contact::kWaysOffPlate - 1);
  }
  Vec3 x = contacts.place(free, sides_[i], start, found, rounding);
  out_.lead[i] =
      std::min(out_.lead[i], found.in_turn ? 0 : std::max(0.0, found.lead - kNearRounds * u_ * contacts.rounds(free)));
  if (!disturbed_) out_.hold[i] = std::min(out_.hold[i], found.hold);
  if (!found.in_turn || present == nullptr || contacts.has_friction()) return x;
  const double margin = Contact::refusal_margin(norm(stored(i, *present)), free, *present, u_);
  const double there = norm(x - free), here = norm(*present - free);
  if (exceeds(i, there - here - margin, 0)) return *present;
  raised = std::max(0.0, there * there - here * here);
  return x;
}

void StepModel::Run::match_shapes(int32_t s, int32_t j) {
  const bool is_last = s + 1 == setup_.step.substeps && j + 1 == setup_.step.iterations;
  const Clusters& clusters = before_.clusters;
  const std::vector<Vec3>& x = y_;
  std::fill(sum_.begin(), sum_.end(), Vec3{});
  if (!disturbed_) std::fill(goal_rounding_.begin(), goal_rounding_.end(), 0.0);
  if (is_last) {
    out_.shape.resize(model_.clusters_.size());
    for (const Cluster& cluster : model_.clusters_) {
      out_.is_thin.push_back(cluster.extent != Cluster::Extent::more);
      out_.arms.push_back(cluster.arms);
    }
  }
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Cluster& cluster = model_.clusters_[at(c)];
    const auto members = clusters.of(c);
    const Vec3* const arm = model_.arm_.data() + cluster.begin;
    const auto terms = static_cast<double>(members.size());
    if (members.empty()) continue;
    const Vec3 base = x[at(members.front())], base_stored = stored(at(members.front()), base);
    Vec3 moment;
    double spread = 0, farthest = 0;  // of what is stored: root mean square from the first member's; greatest
    for (const int32_t i : members) {
      const Vec3 place = stored(at(i), x[at(i)]), from_first = place - base_stored;
      farthest = std::max(farthest, dot(place, place));
      spread += model_.weight_[at(i)] * dot(from_first, from_first);
      moment += model_.weight_[at(i)] * (x[at(i)] - base);
    }
    const Vec3 from_base = moment / cluster.mass;
    spread = std::sqrt(spread / cluster.mass);
    farthest = std::sqrt(farthest);
    Mat3 sum = kNoTerms, sizes = kNoTerms;  // Σ w (x - t) (X - T)ᵀ, and of its terms' sizes
    for (std::size_t k = 0; k < members.size(); ++k) {
      const double w = model_.weight_[at(members[k])];
      const Vec3 now = w * ((x[at(members[k])] - base) - from_base), rest = arm[k];
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          const double term = now[row] * rest[column];
          sum(row, column) += term;
          sizes(row, column) += std::abs(term);
        }
      }
    }
    Eigen::Matrix3d a = as_eigen(sum);
    const Eigen::Matrix3d size = as_eigen(sizes);
    if (is_last) out_.shape[at(c)] = sum;
    Vec3 t = base + from_base;
    // The mean itself is stored, and its sum is taken relative to one member.
    const double mean_amplitude = sum_rounds(terms) * u_ * spread;
    const Vec3 center = stores_positions_ ? t : t - cluster.rest;
    Mat3 r;
    if (disturbed_) {
      const double norm_of_a = a.norm();
      round(Rounded::shape, noise_.key(norm_of_a, at(c)));
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          // Methods for rotations are stable with respect to the norm of their matrix, not entry by entry.
          a(row, column) += u_ * (sum_rounds(terms) * size(row, column) + kRotationRounds * norm_of_a) * noise_();
        }
      }
      t += noise_.off((2 * u_) * center, mean_amplitude);
      r = rotation_of(c, a, size.sum(), u_ * farthest / share_ * cluster.arms, is_last);
      const Vec3 turn = turn_amplitude_ * noise_.vector();
      if (cluster.extent != Cluster::Extent::point) {
        for (int column = 0; column < 3; ++column) {
          const Vec3 now = turned_by(turn, {r(0, column), r(1, column), r(2, column)});
          for (int row = 0; row < 3; ++row) r(row, column) = now[row] + u_ * noise_();
        }
      }
    } else {
      r = rotation_of(c, a, size.sum(), u_ * farthest / share_ * cluster.arms, is_last);
    }
    out_.rotation[at(c)] = r;
    Mat3 map = r;
    VolumeTarget volume;
    double volume_rounding = 0;
    if (const double share = setup_.step.volume_share; share > 0) {
      const double tie = degenerate_rounds(u_) * u_;
      volume = volume_target(to_mat3(a), cluster.moments, r, tie);
      if (disturbed_ && volume.gap <= tie) {  // any of several
        const Eigen::AngleAxisd turn(std::numbers::pi * noise_(), as_eigen(normalized(noise_.vector())));
        const Mat3 towards = to_mat3(turn.toRotationMatrix());
        volume = volume_target(to_mat3(a), cluster.moments, r, tie, &towards);
      }
      const double sums = sum_rounds(terms) * u_, off = sums * size.norm() + kRotationRounds * u_ * a.norm();
      volume_rounding = share * volume.rounding(off, sums, u_);
      if (volume.is_open(off, sums, u_)) note_open(c);
      map = volume.goal_map(share, r);
      if (disturbed_) {
        Mat3 noise;
        for (double& entry : noise.m) entry = share * kRotationRounds * u_ * volume.size * noise_();
        const Mat3& root = volume.inverse_root;
        for (int row = 0; row < 3; ++row) {
          for (int column = 0; column < 3; ++column) {
            for (int k = 0; k < 3; ++k) map(row, column) += noise(row, k) * root(k, column);
          }
        }
      }
    }
    const double of_centers = 1 - setup_.step.volume_share;
    if (disturbed_) t -= map * rest_off_[at(c)] / of_centers;
    const double center_rounding =
        of_centers * of_centers * (4 * u_ * u_ * dot(center, center) + 3 * mean_amplitude * mean_amplitude);
    if (!disturbed_) {
      // A common error of all members moves their sum as a whole; a rest center is off in each iteration.
      const double rest_amplitude = u_ * ((stores_positions_ ? norm(cluster.rest) : 0) + cluster.radius);
      shared_rounding_ +=
          cluster.mass * cluster.mass * (center_rounding + setup_.step.iterations * rest_amplitude * rest_amplitude);
    }
    for (std::size_t k = 0; k < members.size(); ++k) {
      sum_[at(members[k])] += of_centers * t + map * arm[k];
      if (!disturbed_) {
        const double of_volume = volume_rounding > 0 ? volume_rounding * volume.lever(arm[k]) : 0;
        goal_rounding_[at(members[k])] +=
            center_rounding + out_.turn_rounding[at(c)] * dot(arm[k], arm[k]) + of_volume * of_volume;
      }
    }
  }
}

void StepModel::Run::substep(int32_t s) {
  const StepParameters& step = setup_.step;
  const int64_t index = before_.frame * step.substeps + s;
  const double dt = setup_.substep_length[at(before_.frame)] * (1 + step_off_);
  const bool implicit = step.solver == Solver::implicit;
  const double kdt2 = step.stiffness * dt * (dt + step.retardation) * (1 + parameter_off_);
  const double pull = implicit ? kdt2 / (1 + kdt2) : step.relaxation;
  const bool accelerated = step.acceleration == Acceleration::chebyshev;
  const std::vector<ChebyshevWeights> weights =
      accelerated ? chebyshev_weights(pull, step.iterations) : std::vector<ChebyshevWeights>{};

  const std::vector<Wall> walls = walls_now();
  const bool down = setup_.has_blade && setup_.blade_moves[at(index)].down;
  const BladeMove move = down ? move_now(setup_.blade_moves[at(index)]) : BladeMove{};
  const Contact contacts(setup_, down ? &move : nullptr, walls);
  std::vector<const Grip*> held(out_.x.size(), nullptr);
  for (const Grip& grip : setup_.grips) {
    if (grip.active[at(index)] == 0) continue;
    for (const int32_t i : grip.particles) held[at(i)] = &grip;
  }

  const std::vector<Vec3> start = out_.x;
  const bool retarded = step.retardation > 0;
  share_ = retarded ? dt / (dt + step.retardation) * (1 + share_off_) : 1;
  const auto ahead = [&](std::size_t i, Vec3 x) { return retarded ? start[i] + (x - start[i]) / share_ : x; };
  const auto back = [&](std::size_t i, Vec3 y) { return retarded ? start[i] + share_ * (y - start[i]) : y; };
  std::vector<Vec3> predicted(start.size()), predicted_ahead(start.size());
  // Of a disturbed run: Σ m times displacements by contacts and grips, carried on as backends do.
  Vec3 pushed, pushed_earlier;
  rounding_now_.assign(start.size(), 0);
  own_now_.assign(start.size(), 0);
  shared_rounding_ = 0;
  sides_.assign(start.size(), +1);
  is_last_ = s + 1 == step.substeps;
  // Rounds a place that contacts have made of `free`.
  const auto settle = [&](std::size_t i, Vec3 free, Vec3& x, double more) {
    double amplitude = more;
    if (!(x == free) && contacts.has_plate()) amplitude += kContactRounds * u_ * norm(x - move.to.edge);
    const Vec3 place = stored(i, x);
    // A backend may keep y, which it rounds by u |y| <= u (|x| + |start|) / share, and make x of it.
    if (retarded) amplitude += u_ * (norm(place) + norm(stored(i, start[i])) + 3 * norm(x - start[i]));
    amplitude += kUnitRoundoff * norm(x);  // states hold places in double precision, whatever a backend stores
    if (disturbed_) {
      x += noise_.off(u_ * place, amplitude);
    } else {
      const double square = u_ * u_ * dot(place, place) + 3 * amplitude * amplitude;
      rounding_now_[i] += square;
      own_now_[i] += square;
    }
  };
  y_ = start;
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (before_.alive[i] == 0) continue;
    const Vec3 inertia = dt * out_.v[i] + (dt * dt) * step.gravity;
    round(Rounded::prediction, i);
    predicted[i] = start[i] + inertia;
    if (disturbed_) predicted[i] += noise_.off(u_ * stored(i, predicted[i]), 2 * u_ * norm(inertia));
    if (contacts.has_plate()) sides_[i] = side_of(i, contacts, start[i], move);
    double raised = 0;
    out_.x[i] = held[i] != nullptr ? start[i] + held[i]->displacement[at(index)]
                : contacts.any()   ? placed(i, predicted[i], start[i], nullptr, contacts, raised)
                                   : predicted[i];
    const bool is_pushed = !(out_.x[i] == predicted[i]);
    settle(i, predicted[i], out_.x[i], 2 * u_ * norm(inertia));
    predicted_ahead[i] = ahead(i, predicted[i]);
    y_[i] = ahead(i, out_.x[i]);
    if (disturbed_ && is_pushed) pushed += body_.mass[i] * (out_.x[i] - predicted[i]);
  }

  std::vector<Vec3> earlier = y_, now;
  for (int32_t j = 0; j < step.iterations; ++j) {
    ++time_;
    // The implicit solver draws what earlier iterations have rounded to the prediction; others keep it.
    if (implicit && !accelerated && !disturbed_) {
      for (double& square : rounding_now_) square *= pull * pull;
      for (double& square : own_now_) square *= pull * pull;
      shared_rounding_ *= pull * pull;
    }
    match_shapes(s, j);
    now = y_;
    const bool combined = accelerated && j > 0;
    Vec3 pushed_now;
    for (std::size_t i = 0; i < start.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const double holders = model_.holders_[i];
      const Vec3 goal = holders > 0 ? step.volume_share * now[i] + sum_[i] / holders : now[i];
      const Vec3 from = implicit ? predicted_ahead[i] : now[i];
      const Vec3 plain_ahead = from + pull * (goal - from), plain = back(i, plain_ahead);
      Vec3 free = plain;
      double amplitude =
          share_ * u_ * pull * (2 * norm(goal - from) + step.volume_share * norm(now[i] - from) + model_.lever_[i]);
      if (combined) {
        const Vec3 drawn = weights[at(j)].pull * (plain_ahead - now[i]);
        const Vec3 swung = weights[at(j)].carry * (now[i] - earlier[i]);
        free = back(i, now[i] + drawn + swung);
        // The carry is a weight ω less 1, so it rounds as ω does.
        amplitude += share_ * kParameterRounds * u_ * (norm(drawn) + norm(swung) + norm(now[i] - earlier[i]));
      }
      // A backend knows how far a contact or a grip has displaced a particle from where it has rounded it to.
      const auto note_push = [&] {
        if (!disturbed_) return;
        round(Rounded::push, i);
        pushed_now += body_.mass[i] * (out_.x[i] - free - noise_.off(u_ * stored(i, free), amplitude));
      };
      if (held[i] != nullptr) {
        note_push();
        continue;
      }
      Vec3& next = out_.x[i];
      const Vec3 present_place = next;
      next = free;
      round(Rounded::place, i);
      Vec3 wanted = free;
      if (contacts.any()) {
        // Where several answers are right, the way there decides: touched particles go the plain way.
        bool touched = true;
        if (combined && contacts.path_matters()) {
          const auto deepest = [&](double near) {
            const Contact::Depth of_free = contacts.depth(free, sides_[i], near),
                                 of_plain = contacts.depth(plain, sides_[i], near);
            const double margin = kTouchMargin * body_.grid.spacing;
            return Contact::Depth{std::max(of_free.least, of_plain.least) + margin,
                                  std::max(of_free.most, of_plain.most) + margin};
          };
          const double rounds = kNearRounds * u_ * contacts.rounds(free), depth = deepest(0).most;
          const Contact::Depth near = deepest(rounds);
          touched = exceeds(i, depth, near.least <= 0 && near.most > 0 ? std::abs(depth) : rounds);
          if (touched) wanted = plain;
        }
        if (touched) {
          double raised = 0;
          next = placed(i, wanted, start[i], &present_place, contacts, raised);
          if (s + 1 == step.substeps && j + 1 == step.iterations) out_.raised[i] = raised;
        }
      }
      const bool is_pushed = !(next == free);
      settle(i, wanted, next, amplitude);
      y_[i] = ahead(i, next);
      if (is_pushed) note_push();
      if (!disturbed_ && holders > 0) {
        rounding_now_[i] += share_ * share_ * pull * pull * goal_rounding_[i] / (holders * holders);
      }
    }
    earlier = now;
    Vec3 carried = (implicit ? pull : 1.0) * pushed;
    if (combined) {
      carried = pushed + weights[at(j)].pull * (carried - pushed) + weights[at(j)].carry * (pushed - pushed_earlier);
    }
    pushed_earlier = pushed;
    pushed = carried + pushed_now;
  }

  const double decay = std::exp(-step.damping * dt);
  double pushed_rounding = share_ * share_ * pull * pull * shared_rounding_, summed = 0;
  const double carried_on = step.substeps - s, carrying = kParameterRounds * std::sqrt(step.iterations + 1.0);
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (before_.alive[i] == 0) continue;
    const Vec3 push = out_.x[i] - predicted[i];
    round(Rounded::end, i);
    // Exactly, the balance of momentum says the same, with nothing carried on.
    if (!disturbed_) pushed += body_.mass[i] * push;
    // A backend adds up the pushes of contacts in each iteration.
    if (disturbed_) pushed += body_.mass[i] * noise_.off((carrying * u_) * push, 0);
    out_.v[i] = (decay / dt) * (out_.x[i] - start[i]);
    if (disturbed_) out_.v[i] += noise_.off((kParameterRounds * u_) * out_.v[i], 0);
    out_.rounding[i] += carried_on * carried_on * rounding_now_[i];
    out_.own_rounding[i] += carried_on * carried_on * own_now_[i];
    pushed_rounding +=
        body_.mass[i] * body_.mass[i] * (rounding_now_[i] + carrying * carrying * u_ * u_ * dot(push, push));
    summed += body_.mass[i] * norm(push);
  }
  // Partial sums, which are as large as the whole.
  summed *= u_ * std::sqrt(static_cast<double>(start.size()));
  pushed_rounding += 3 * summed * summed;
  round(Rounded::impulse, 0);
  if (disturbed_) pushed += summed * noise_.vector();
  ++time_;
  out_.impulse = decay * (out_.impulse + pushed / dt);
  out_.impulse_rounding += pushed_rounding / (dt * dt);
}

StepOutcome StepModel::run(const Wanted& wanted) const { return Run(*this, wanted).run(); }

}  // namespace cutproof::oracles
