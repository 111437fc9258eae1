// Two runs of one body beside each other: which moments they have in common, and how far apart they are.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/state.h"
#include "report/pictures.h"

namespace cutproof::report {

// A run beside the one that a page is about.
struct Beside {
  Source source;
  bool is_shown = false;       // its pictures stand beside; without, the page holds the distance to it alone
  std::string name, own_name;  // of it, and of the run that the page is about
  std::string obtained;        // what the distance to it is, in words for a person
};

// How far apart two states are.
struct Apart {
  double max = 0, rms = 0;     // of the positions of particles that are alive in both [h]
  int32_t where = -1;          // the particle of the greatest; -1 if no particle is alive in both
  std::string differs;         // in what they differ first, in words; empty: they are equal to the bit
  bool is_decision = false;    // particles are alive, clusters or triangles are there, in one of them alone
  std::vector<uint8_t> codes;  // [n], see code_of
};
// States of the same body; they may be as wrong as they like. What is not finite is infinitely far apart.
Apart apart_of(const State& one, const State& other, double spacing);

// A distance [h] as a byte: 0 for none at all, else four to a decade from 1e-18 h on; kIncomparable where a particle is
// alive in one state only, or somewhere that is no place.
inline constexpr uint8_t kIncomparable = 255;
uint8_t code_of(double distance);

// A moment of both runs, in time: `own` and `other` are the snapshots that show it, each the last one up to then.
struct Together {
  Moment moment;
  int64_t own = 0, other = 0;
  bool is_own = true, is_other = true;  // which of the two has a snapshot of this moment
  bool is_comparable = true;  // both states are those of this moment: a run that has snapshots of other stages of a
                              // frame has none of a stage that had nothing to do
};
// All moments that one of the two has; where `other` is not shown, those that both have, and all others of the first.
std::vector<Together> together(const std::vector<Moment>& own, const std::vector<Moment>& other, bool is_shown);

struct FirstApart {
  Moment moment;
  std::string differs;
  double max = 0;
};
struct Comparison {
  std::optional<FirstApart> any, decision;  // the first moment that differs at all, and in a decision
  std::optional<FirstApart> greatest;       // the one in which positions are farthest apart
  int64_t compared = 0;                     // moments
};
// Walks all of both once.
Comparison compare(const Source& own, const Beside& beside, const std::vector<Together>& moments);

// The moments of a source, in its own order.
std::vector<Moment> moments_of(const Source& source);

}  // namespace cutproof::report
