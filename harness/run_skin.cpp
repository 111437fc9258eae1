#include "harness/run_skin.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "oracles/oracles.h"
#include "oracles/shells.h"

namespace cutproof::harness {

// Of several the first that fails.
void RunSkin::take(std::optional<Verdict>& known, Verdict verdict, int64_t frame) {
  if (known && !known->holds) return;
  verdict.frame = frame;
  if (known) verdict.checked += known->checked;
  known = std::move(verdict);
}

void RunSkin::see(const RunFrames& frames, const oracles::RunJudge& judge) {
  const oracles::RunFrame& frame = frames.frame();
  if (!frames.segment().has_vertices()) return;
  const bool is_finite_all = std::ranges::all_of(frames.skin_places(), [](Vec3 x) { return is_finite(x); });
  if (!frames.has_new_triangles() && frame.blade.empty() && is_finite_all) return;
  const std::optional<Skin> skin = frames.skin();
  bool any_alive = false;
  for (std::size_t i = 0; i < frame.positions.size() && !any_alive; ++i) any_alive = oracles::exists(frame, i);
  const Verdict surface = closed_skin(*skin, any_alive);
  take(surface_, surface, frame.index);
  if (!frames.header().promised(oracles::RunPromise::skin) || !surface.holds) return;
  const oracles::RunPieces pieces = judge.pieces();
  if (pieces.units == 0) return;
  const int64_t shells = oracles::count_shells(*skin).outer;
  const oracles::Property& property = oracles::property_named(oracles::core_properties(), "skin match");
  Verdict match;
  match.property = property.name;
  match.unit = property.unit;
  match.bound_source = "tolerances.md, Runs";
  match.checked = shells;
  match.measured = static_cast<double>(std::max({pieces.pieces - shells, shells - pieces.at_most, int64_t{0}}));
  match.holds = match.measured == 0;
  if (!match.holds) {
    match.witness.text = fmt::format(
        "the skin has {} outer {} in frame {}, and the tissue is in {}", shells, shells == 1 ? "shell" : "shells",
        frame.index,
        pieces.at_most > pieces.pieces ? fmt::format("{} to {} pieces", pieces.pieces, pieces.at_most)
                                       : fmt::format("{} {}", pieces.pieces, pieces.pieces == 1 ? "piece" : "pieces"));
  }
  take(match_, std::move(match), frame.index);
}

void RunSkin::finish(bool is_promised, JudgedRun& judged) const {
  if (!judged.given.contains("vertices")) return;
  if (surface_) judged.verdicts.push_back(*surface_);
  if (match_) {
    judged.verdicts.push_back(*match_);
  } else {
    judged.not_judged.push_back({"skin match", !is_promised                   ? "needs the promise 'skin'"
                                               : surface_ && !surface_->holds ? "the skin is no closed surface"
                                                                              : "needs tissue"});
  }
  judged.not_judged.push_back(
      {"skin geometry", "self-intersection is judged at rest, and the rest positions of its vertices are not known"});
}

}  // namespace cutproof::harness
