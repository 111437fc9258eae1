// Simpler cases.
#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "property_tests/cases.h"

namespace cutproof::property_tests {
namespace {

using Edits = std::vector<std::function<void(Case&)>>;

// Without a run of elements: all, halves, quarters, … down to single ones. About 2n edits of n elements.
template <typename T>
void drop_chunks(std::size_t count, std::vector<T> Case::*list, Edits& edits) {
  for (std::size_t length = count; length > 0; length = length == 1 ? 0 : (length + 1) / 2) {
    for (std::size_t begin = 0; begin < count; begin += length) {
      edits.push_back([list, begin, end = std::min(begin + length, count)](Case& c) {
        auto& elements = c.*list;
        elements.erase(elements.begin() + static_cast<std::ptrdiff_t>(begin),
                       elements.begin() + static_cast<std::ptrdiff_t>(end));
      });
    }
  }
}

// Without the particles on one side of a plane of the grid.
void drop_slabs(const std::vector<Node>& nodes, Edits& edits) {
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    const auto [low, high] = extent(nodes, axis);
    for (const int32_t plane : {(low + high + 1) / 2, low + 1, high}) {
      for (const bool keep_lower : {true, false}) {
        edits.push_back([axis, plane, keep_lower](Case& c) {
          std::erase_if(c.nodes, [&](const Node& node) { return (node[axis] < plane) != keep_lower; });
        });
      }
    }
  }
}

// Body, strokes, walls and grips to the origin.
void shift(const std::vector<Node>& nodes, Edits& edits) {
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    edits.push_back([axis, low = extent(nodes, axis).first](Case& c) {
      for (Node& node : c.nodes) node[axis] -= low;
      for (CaseGrip& grip : c.grips) {
        grip.low[axis] -= low;
        grip.high[axis] -= low;
      }
      for (CaseWall& wall : c.walls) {
        if (at(wall.axis) == axis) wall.offset -= 4 * low;
      }
      for (Stroke& stroke : c.strokes) {
        stroke.from[axis] -= 4 * low;
        stroke.to[axis] -= 4 * low;
      }
    });
  }
}

// To the value wanted, and halfway there.
template <typename T>
void towards(const Case& from, T Case::*field, T wanted, Edits& edits) {
  edits.push_back([field, wanted](Case& c) { c.*field = wanted; });
  if constexpr (std::is_same_v<T, int32_t>) {
    const int32_t halfway = wanted + (from.*field - wanted) / 2;
    edits.push_back([field, halfway](Case& c) { c.*field = halfway; });
  }
  if constexpr (std::is_same_v<T, ClusterKind>) {
    if (from.*field == ClusterKind::foreign) edits.push_back([field](Case& c) { c.*field = ClusterKind::sampled; });
  }
}

void simplify_stroke(const Case& from, std::size_t k, Edits& edits) {
  edits.push_back([k](Case& c) { c.strokes[k].down = true; });
  for (Quarters Stroke::*vector : {&Stroke::turn, &Stroke::tilt, &Stroke::along}) {
    edits.push_back([=](Case& c) { c.strokes[k].*vector = {0, 0, 0}; });
    for (std::size_t axis = 0; axis < 3; ++axis) {
      edits.push_back([=](Case& c) { (c.strokes[k].*vector)[axis] = 0; });
      edits.push_back([=](Case& c) { (c.strokes[k].*vector)[axis] /= 2; });
    }
  }
  edits.push_back([k](Case& c) {
    c.strokes[k] = resolved_strokes(c)[k];
    c.strokes[k].link = Link::apart;
  });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (Quarters Stroke::*end : {&Stroke::from, &Stroke::to}) {
      const int32_t value = (from.strokes[k].*end)[axis];  // division rounds towards zero: each step is a shorter one
      for (const int32_t simpler : {0, value / 2, 4 * (value / 4), 2 * (value / 2)}) {
        edits.push_back([=](Case& c) { (c.strokes[k].*end)[axis] = simpler; });
      }
    }
  }
}

void simplify_grip(std::size_t k, Edits& edits) {
  edits.push_back([k](Case& c) { c.grips[k].pull = {0, 0, 0}; });
  edits.push_back([k](Case& c) { c.grips[k].from = 0; });
  edits.push_back([k](Case& c) { c.grips[k].until = -1; });
  edits.push_back([k](Case& c) { c.grips[k].high = c.grips[k].low; });
  edits.push_back([k](Case& c) { c.grips[k].shared = false; });
}

}  // namespace

std::vector<std::function<void(Case&)>> simplifications(const Case& c) {
  Edits edits;
  drop_chunks(c.strokes.size(), &Case::strokes, edits);
  drop_slabs(c.nodes, edits);
  drop_chunks(c.nodes.size(), &Case::nodes, edits);

  drop_chunks(c.walls.size(), &Case::walls, edits);
  drop_chunks(c.grips.size(), &Case::grips, edits);

#define FIELD(Type, name, value, simplest) towards(c, &Case::name, Type{simplest}, edits);
#include "property_tests/case_fields.inc"
  for (std::size_t k = 0; k < c.strokes.size(); ++k) simplify_stroke(c, k, edits);
  for (std::size_t k = 0; k < c.walls.size(); ++k) {
    edits.push_back([k](Case& simpler) { simpler.walls[k].friction = 0; });
  }
  for (std::size_t k = 0; k < c.grips.size(); ++k) simplify_grip(k, edits);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    edits.push_back([axis](Case& simpler) { simpler.gravity[axis] = 0; });
    edits.push_back([axis](Case& simpler) { simpler.gravity[axis] /= 2; });
  }
  shift(c.nodes, edits);
  return edits;
}

Case simplest(Case c, const std::function<bool(const Case&)>& fails, const std::function<bool()>& is_over) {
  for (bool found = true; found && !is_over();) {
    found = false;
    for (const auto& edit : simplifications(c)) {
      if (is_over()) break;
      Case simpler = c;
      edit(simpler);
      if (simpler == c || !fails(simpler)) continue;
      c = std::move(simpler);
      found = true;
      break;
    }
  }
  return c;
}

}  // namespace cutproof::property_tests
