#include "cli/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "model/io/filled.h"

namespace cutproof::cli {

namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr std::size_t kGap = 2;  // before each column
constexpr std::size_t kNarrowestSentence = 16;

// What stands in one column: how wide it is, and how wide it has to be.
struct Extent {
  std::size_t head = 0, longest_word_of_head = 0, cells = 0;
  bool has_sentences = false;  // cells of several words, so that they may be broken
};

std::size_t longest_word(const std::string& text) {
  std::size_t longest = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    longest = std::max(longest, io::width_of(text.substr(at, end - at)));
    at = end + 1;
  }
  return longest;
}

std::vector<Extent> extents_of(const Rows& rows, bool has_head) {
  std::vector<Extent> extents;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    extents.resize(std::max(extents.size(), rows[r].size()));
    for (std::size_t k = 0; k < rows[r].size(); ++k) {
      const std::string& cell = rows[r][k];
      Extent& extent = extents[k];
      if (has_head && r == 0) {
        extent.head = io::width_of(cell);
        extent.longest_word_of_head = longest_word(cell);
      } else {
        extent.cells = std::max(extent.cells, io::width_of(cell));
        extent.has_sentences =
            extent.has_sentences || (io::width_of(cell) > kNarrowestSentence && cell.find(' ') != std::string::npos);
      }
    }
  }
  return extents;
}

// The first column always stands two spaces in.
std::size_t total(const std::vector<std::size_t>& widths, std::size_t gap) {
  return std::accumulate(widths.begin(), widths.end(), widths.empty() ? 0 : kGap + gap * (widths.size() - 1));
}

// The widest of them takes what is left, as long as it is wide enough to be read.
void narrow_sentences(const std::vector<Extent>& extents, std::size_t columns, std::size_t gap,
                      std::vector<std::size_t>& widths) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < widths.size(); ++k) {
    if (extents[k].has_sentences) order.push_back(k);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return widths[a] > widths[b]; });
  for (const std::size_t k : order) {
    const std::size_t now = total(widths, gap);
    if (now <= columns) break;
    const std::size_t least = std::max(kNarrowestSentence, extents[k].longest_word_of_head);
    widths[k] = widths[k] > least + (now - columns) ? widths[k] - (now - columns) : std::min(widths[k], least);
  }
}

// Cells over as many lines as they take in columns of these widths.
std::string set_out(const Rows& rows, const std::vector<std::size_t>& widths, const std::vector<std::size_t>& shown,
                    std::size_t gap, bool has_head) {
  std::vector<bool> is_broken(widths.size(), false);
  for (std::size_t r = has_head ? 1 : 0; r < rows.size(); ++r) {
    for (std::size_t k = 0; k < rows[r].size(); ++k) {
      is_broken[k] = is_broken[k] || io::width_of(rows[r][k]) > widths[k];
    }
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::vector<std::vector<std::string>> cells(widths.size());
    std::size_t height = 1;
    for (const std::size_t k : shown) {
      if (k < rows[r].size()) cells[k] = io::wrapped(rows[r][k], widths[k], 0);
      height = std::max(height, cells[k].size());
    }
    for (std::size_t l = 0; l < height; ++l) {
      std::string line;
      for (const std::size_t k : shown) {
        // A head that is lower than others stands directly above its column.
        const std::size_t above = has_head && r == 0 ? height - cells[k].size() : 0;
        const std::string cell = l >= above && l - above < cells[k].size() ? cells[k][l - above] : std::string();
        const std::string padding(widths[k] - std::min(widths[k], io::width_of(cell)), ' ');
        const bool flush_left = k == 0 || is_broken[k];
        line += std::string(k == 0 ? kGap : gap, ' ') + (flush_left ? cell + padding : padding + cell);
      }
      text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
  }
  return text;
}

}  // namespace

std::string Table::text(std::size_t names, std::size_t columns) const {
  const std::vector<Extent> extents = extents_of(rows_, has_head_);
  std::vector<std::size_t> widths, all(extents.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (const Extent& extent : extents) widths.push_back(std::max(extent.head, extent.cells));
  names = std::min(names, widths.size());
  std::size_t gap = kGap;
  if (total(widths, gap) > columns) {
    for (std::size_t k = 0; k < widths.size(); ++k) {
      widths[k] = std::max(extents[k].longest_word_of_head, extents[k].cells);
    }
    const std::vector<std::size_t> before = widths;
    narrow_sentences(extents, columns, gap, widths);
    if (total(widths, gap) > columns) {
      gap = 1;
      widths = before;
      narrow_sentences(extents, columns, gap, widths);
    }
    if (total(widths, gap) > columns) {  // in parts, which have more room
      gap = kGap;
      widths = before;
    }
  }
  if (total(widths, gap) <= columns) return set_out(rows_, widths, all, gap, has_head_);
  // Parts. What names a row leaves a third of the room to the rest at least.
  const auto of_names = [&] {
    return total({widths.begin(), widths.begin() + static_cast<std::ptrdiff_t>(names)}, gap);
  };
  if (of_names() > columns * 2 / 3) {
    for (std::size_t k = 0; k < names; ++k) widths[k] = std::min(widths[k], columns * 2 / 3 / names - gap);
  }
  const std::size_t named = of_names();
  for (std::size_t k = names; k < widths.size(); ++k) widths[k] = std::min(widths[k], columns - named - gap);
  std::string text;
  for (std::size_t next = names; next < widths.size();) {
    std::vector<std::size_t> shown(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(names));
    std::size_t wide = named;
    while (next < widths.size() && (shown.size() == names || wide + gap + widths[next] <= columns)) {
      wide += gap + widths[next];
      shown.push_back(next++);
    }
    text += (text.empty() ? "" : "\n") + set_out(rows_, widths, shown, gap, has_head_);
  }
  return text;
}

Column::Column(std::string above, const std::string& text)
    : Column(std::move(above), [text](const nlohmann::json& row) { return io::filled(text, row); }) {}

std::string table_of(const nlohmann::json& rows, const std::vector<Column>& columns, std::size_t names) {
  std::vector<std::string> head;
  for (const Column& column : columns) head.push_back(column.head);
  Table table(head);
  for (const nlohmann::json& row : rows) {
    std::vector<std::string> cells;
    for (const Column& column : columns) cells.push_back(column.cell(row));
    table.add(cells);
  }
  return table.text(names);
}

}  // namespace cutproof::cli
