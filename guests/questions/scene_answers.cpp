// An answer as the files of a run.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/questions/scenes.h"
#include "model/at.h"

namespace cutproof::guests::scenes {

namespace {

// How many there are in each frame, of something that comes to `total`; -1: as before. "" or the defect.
std::string problem_of_counts(const Array& counts, int64_t frames, int64_t least, int64_t total,
                              std::string_view what) {
  if (counts.rows() != frames) {
    return fmt::format("'{}' has {} rows, and {} frames are wanted", counts.name, counts.rows(), frames);
  }
  int64_t sum = 0;
  for (int64_t f = 0; f < frames; ++f) {
    if (counts.integer(f) < least) return fmt::format("'{}' holds {}", counts.name, counts.integer(f));
    sum += std::max<int64_t>(counts.integer(f), 0);
  }
  return sum == total ? "" : fmt::format("'{}' adds up to {}, and '{}' has {}", counts.name, sum, what, total);
}

}  // namespace

RunFiles run_files(const Question& question, const Arrays& answers, Precision precision) {
  const Scene scene = scene_of(question.given);
  RunFiles run;
  const auto answer = [&](const std::string& name) -> const Array& { return *find_array(answers, "run/" + name); };
  const auto refuse = [&](std::string problem) {
    run.problem = std::move(problem);
    return run;
  };
  // Particles.
  std::vector<int64_t> first = {0};  // [frames + 1]
  const Array &particles = answer("particles"), &position = answer("position");
  if (particles.rows() > 0) {
    std::string problem = problem_of_counts(particles, scene.frames, 1, position.rows(), position.name);
    if (!problem.empty()) return refuse(std::move(problem));
  }
  for (int64_t f = 0; f < scene.frames; ++f) {
    first.push_back(first.back() + (particles.rows() > 0 ? particles.integer(f) : scene.count()));
  }
  if (first[1] != scene.count()) {
    return refuse(fmt::format("it starts with {} particles, and the body has {}", first[1], scene.count()));
  }
  if (position.rows() != first.back()) {
    return refuse(fmt::format("'{}' has {} rows, and {} frames of {} particles are wanted", position.name,
                              position.rows(), scene.frames, scene.count()));
  }
  for (const auto& [names, rows] :
       {std::pair{std::vector<std::string>{"velocity", "spin", "mass", "alive", "parent"}, first.back()},
        {{"contact_impulse", "energy", "seconds"}, scene.frames},
        {{"steps", "damping"}, int64_t{1}}}) {
    for (const std::string& name : names) {
      const Array& array = answer(name);
      if (array.rows() != 0 && array.rows() != rows) {
        return refuse(fmt::format("'{}' has {} rows; {} or none are wanted", array.name, array.rows(), rows));
      }
    }
  }
  // Groups and cells.
  const Array &group_count = answer("group_count"), &offsets = answer("offsets"), &members = answer("members"),
              &weights = answer("weights"), &cell_count = answer("cell_count");
  const bool has_groups = group_count.rows() > 0, has_cells = cell_count.rows() > 0;
  if (answer("tetrahedra").rows() > 0 && answer("hexahedra").rows() > 0)
    return refuse("'run/tetrahedra' and 'run/hexahedra' are both given; give one of them");
  if (weights.rows() > 0 && !has_groups) return refuse("'run/weights' is given, and no groups are");
  const std::string cells_name = answer("tetrahedra").rows() > 0 ? "tetrahedra" : "hexahedra";
  const Array& cells = answer(cells_name);
  if (has_groups || offsets.rows() + members.rows() > 0) {
    const auto ends = offsets.of<int64_t>();
    std::string problem =
        problem_of_counts(group_count, scene.frames, -1, std::max<int64_t>(offsets.rows() - 1, 0), offsets.name);
    if (!problem.empty()) return refuse(std::move(problem));
    if (ends.empty() || ends.front() != 0 || ends.back() != members.rows() ||
        !std::is_sorted(ends.begin(), ends.end())) {
      return refuse(fmt::format("'{}' does not begin at 0, ascend and end at {}", offsets.name, members.rows()));
    }
    if (weights.rows() != 0 && weights.rows() != members.rows())
      return refuse(
          fmt::format("'{}' has {} rows, and '{}' has {}", weights.name, weights.rows(), members.name, members.rows()));
  }
  if (has_cells || cells.rows() > 0) {
    std::string problem = problem_of_counts(cell_count, scene.frames, -1, cells.rows(), cells.name);
    if (!problem.empty()) return refuse(std::move(problem));
  }

  const bool is_held = std::find(scene.held.begin(), scene.held.end(), 1) != scene.held.end();
  int64_t group = 0, cell = 0;
  for (int64_t f = 0; f < scene.frames; ++f) {
    io::ArrayFile& file = run.frames.emplace_back();
    const auto add = [&](Array array, std::string name, std::vector<int64_t> shape) {
      array.name = std::move(name);
      array.shape = std::move(shape);
      file.arrays.push_back(std::move(array));
    };
    const auto put = [&](std::string name, const std::string& of, int64_t begin, int64_t end,
                         std::vector<int64_t> shape) {
      if (answer(of).rows() > 0) add(rows_of(answer(of), begin, end), std::move(name), std::move(shape));
    };
    const int64_t begin = first[at(f)], end = first[at(f) + 1], n = end - begin;
    put("positions", "position", begin, end, {1, n, 3});
    put("velocities", "velocity", begin, end, {1, n, 3});
    put("spin", "spin", begin, end, {1, n, 3});
    put("alive", "alive", begin, end, {1, n});
    put("mass", "mass", begin, end, {n});
    put("parent", "parent", begin, end, {n});
    put("contact_impulse", "contact_impulse", f, f + 1, {1, 3});
    put("energy", "energy", f, f + 1, {1});
    add(make_array("", {}, std::vector<double>{static_cast<double>(f) * scene.frame_time}), "time", {1});
    if (is_held) {
      std::vector<uint8_t> held = scene.held;
      held.resize(at(n));
      for (int64_t i = scene.count(); i < n && answer("parent").rows() > 0; ++i) {
        const int64_t parent = answer("parent").integer(begin + i);
        held[at(i)] = parent >= 0 && parent < i ? held[at(parent)] : 0;
      }
      add(make_array("", {}, held), "held", {1, n});
    }
    const auto quads = std::span(scene.blade).subspan(at(f * scene.blades * 4), at(scene.blades * 4));
    if (std::any_of(quads.begin(), quads.end(), [](Vec3 x) { return std::isfinite(x.x); }))
      add(make_array("", {}, numbers_of({quads.begin(), quads.end()})), "blade", {1, scene.blades, 4, 3});
    if (const int64_t count = has_groups ? group_count.integer(f) : -1; count >= 0) {
      std::vector<int64_t> ends;
      for (int64_t g = group; g <= group + count; ++g) ends.push_back(offsets.integer(g) - offsets.integer(group));
      const int64_t from = offsets.integer(group), to = from + ends.back();
      add(make_array("", {}, ends), "groups_offsets", {count + 1});
      add(rows_of(members, from, to), "groups_members", {to - from});
      put("groups_weights", "weights", from, to, {to - from});
      group += count;
    }
    if (const int64_t count = has_cells ? cell_count.integer(f) : -1; count >= 0) {
      add(rows_of(cells, cell, cell + count), "cells", {count, cells.columns()});
      cell += count;
    }
    if (f > 0) continue;
    const auto give = [&](const char* name) {
      add(*find_array(question.given, name), name, find_array(question.given, name)->shape);
    };
    for (const char* const name : {"rest", "gravity", "spacing"}) give(name);
    if (answer("mass").rows() == 0) give("mass");
    put("steps", "steps", 0, 1, {1});
    put("damping", "damping", 0, 1, {1});
    std::vector<int32_t> edges;
    for (const auto& [a, b] : scene.edges) edges.insert(edges.end(), {a, b});
    if (!edges.empty()) add(make_array("", {}, edges), "edges", {std::ssize(scene.edges), 2});
    const Array& cut_resolution = *find_array(question.known, "cut_resolution");
    add(cut_resolution, cut_resolution.name, {1});
    add(make_array("", {}, std::vector<double>{unit_roundoff(precision)}), "unit_roundoff", {1});
    std::string words;
    const int64_t promises = find_array(question.known, "promises")->integer(0);
    for (std::size_t k = 0; k < oracles::kRunPromises.size(); ++k) {
      if ((promises >> k & 1) != 0) words += (words.empty() ? "" : " ") + std::string(oracles::kRunPromises[k]);
    }
    file.texts.push_back({"promises", words});
  }
  return run;
}

std::vector<io::ArrayFile> files_of(const Question& question, const Arrays& answers, Precision precision) {
  return run_files(question, answers, precision).frames;
}

}  // namespace cutproof::guests::scenes
