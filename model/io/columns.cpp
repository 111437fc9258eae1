#include "model/io/columns.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "model/printable.h"

namespace cutproof::io {

namespace {

struct Range {
  uint32_t first, last;
};
// Unicode 15: combining marks and other characters without width; East Asian wide characters and emoji. Of each block
// the part that can come from a file's name.
constexpr std::array<Range, 7> kNoWidth = {{{0x0300, 0x036F},
                                            {0x0483, 0x0489},
                                            {0x0591, 0x05BD},
                                            {0x200C, 0x200D},
                                            {0x20D0, 0x20F0},
                                            {0xFE00, 0xFE0F},
                                            {0xFE20, 0xFE2F}}};
constexpr std::array<Range, 10> kWide = {{{0x1100, 0x115F},
                                          {0x2E80, 0x303E},
                                          {0x3041, 0x4DBF},
                                          {0x4E00, 0xA4CF},
                                          {0xAC00, 0xD7A3},
                                          {0xF900, 0xFAFF},
                                          {0xFE30, 0xFE6F},
                                          {0xFF00, 0xFF60},
                                          {0x1F300, 0x1FAFF},
                                          {0x20000, 0x3FFFD}}};

template <std::size_t N>
bool lies_in(uint32_t code, const std::array<Range, N>& ranges) {
  return std::any_of(ranges.begin(), ranges.end(),
                     [code](const Range& range) { return range.first <= code && code <= range.last; });
}

// A unit of a terminal: bytes, and columns.
struct Glyph {
  std::size_t bytes = 1, columns = 1;
};

Glyph glyph_at(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
  const uint32_t first = byte(at);
  if (first == 0x1B && byte(at + 1) == '[') {  // a colour: ESC [ digits m
    std::size_t end = at + 2;
    while (end < text.size() && (byte(end) == ';' || (byte(end) >= '0' && byte(end) <= '9'))) ++end;
    if (byte(end) == 'm') return {end + 1 - at, 0};
  }
  // An unprintable character is shown as its escape (model/printable.h).
  const std::string_view rest = std::string_view(text).substr(at);
  const Character character = first_character(rest);
  if (character.bytes == 0) return {1, 4};
  if (first == '\t') return {1, 1};
  if (!is_printable(character.code)) {
    std::size_t columns = 0;
    escape_character(character, static_cast<unsigned char>(first), [&](std::string_view e) { columns = e.size(); });
    return {character.bytes, columns};
  }
  const uint32_t code = character.code;
  return {character.bytes, lies_in(code, kNoWidth) ? 0U : lies_in(code, kWide) ? 2U : 1U};
}

}  // namespace

std::size_t width_of(const std::string& text) {
  std::size_t columns = 0;
  for (std::size_t at = 0; at < text.size();) {
    const Glyph glyph = glyph_at(text, at);
    columns += glyph.columns;
    at += glyph.bytes;
  }
  return columns;
}

std::string cut_to(const std::string& text, std::size_t columns) {
  std::size_t at = 0, taken = 0;
  while (at < text.size()) {
    const Glyph glyph = glyph_at(text, at);
    if (taken + glyph.columns > columns) break;
    taken += glyph.columns;
    at += glyph.bytes;
  }
  return text.substr(0, at);
}

std::string cut_to_words(const std::string& text, std::size_t columns) {
  const std::size_t end = cut_to(text, columns).size();
  if (end == text.size()) return text;
  // The separator may lie beyond the end.
  for (const char* const separator : {", ", " "}) {
    const std::size_t at = text.rfind(separator, end);
    if (at != std::string::npos) return text.substr(0, at);
  }
  return "";
}

std::vector<std::string> wrapped(const std::string& line, std::size_t columns, std::size_t hang) {
  if (width_of(line) <= columns) return {line};
  std::vector<std::string> lines;
  const std::string indentation(std::min(hang, columns / 2), ' ');
  std::size_t at = std::min(line.find_first_not_of(' '), line.size());
  std::string now = line.substr(0, at);
  bool is_empty = true;  // but for its indentation
  const auto end_line = [&] {
    lines.push_back(now.substr(0, now.find_last_not_of(' ') + 1));
    now = indentation;
    is_empty = true;
  };
  while (at < line.size()) {
    const std::size_t end = std::min(line.find(' ', at), line.size());
    std::string word = line.substr(at, end - at);
    at = std::min(line.find_first_not_of(' ', end), line.size());
    const std::string gap(at - end, ' ');
    if (!is_empty && width_of(now) + width_of(word) > columns) end_line();
    const bool is_path = word.find('/') != std::string::npos;
    while (!is_path && width_of(now) + width_of(word) > columns) {
      std::string piece = cut_to(word, columns - width_of(now));
      if (piece.empty()) piece = word.substr(0, glyph_at(word, 0).bytes);
      now += piece;
      word.erase(0, piece.size());
      end_line();
    }
    now += word + gap;
    is_empty = is_empty && word.empty();
  }
  if (!is_empty) end_line();
  return lines;
}

std::string wrapped_text(const std::string& text, std::size_t columns) {
  std::string result;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    const std::size_t hang = std::min(line.find_first_not_of(' '), line.size()) + 2;
    bool first = true;
    for (const std::string& piece : wrapped(line, columns, hang)) {
      result += (first ? "" : "\n") + piece;
      first = false;
    }
    if (end < text.size()) result += '\n';
    begin = end + 1;
  }
  return result;
}

std::string hanging(const std::string& line, std::size_t hang, std::size_t columns) {
  std::string result;
  for (const std::string& piece : wrapped(line, columns, hang)) result += (result.empty() ? "" : "\n") + piece;
  return result;
}

std::string grouped(long long count) {
  std::string digits = std::to_string(count);
  for (std::size_t k = digits.size(); k > 3 + (count < 0 ? 1U : 0U);) digits.insert(k -= 3, ",");
  return digits;
}

}  // namespace cutproof::io
