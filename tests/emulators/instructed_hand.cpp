#include "instructed_hand.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <utility>

namespace hapticd::emulators {

namespace {

using Kind = sim::HandProgram::Kind;

constexpr double kClearOfObjectsMm = 80.0;

bool says(const std::string& words, const char* what) {
  return words.find(what) != std::string::npos;
}

/// The numbers in the words, in order, up to what has come of them so far.
std::array<double, 4> numbers_in(const std::string& words) {
  std::array<double, 4> numbers{};
  std::size_t found = 0;
  const std::string text = words.substr(0, words.find(" ("));
  for (std::size_t i = 0; i < text.size() && found < numbers.size();) {
    const bool negative = text[i] == '-' && i + 1 < text.size() && std::isdigit(text[i + 1]) != 0 &&
                          (i == 0 || std::isspace(text[i - 1]) != 0);
    if (!negative && std::isdigit(text[i]) == 0) {
      ++i;
      continue;
    }
    char* end = nullptr;
    numbers[found++] = std::strtod(text.c_str() + i, &end);
    i = static_cast<std::size_t>(end - text.c_str());
  }
  return numbers;
}

/// "instruction":"..." of a line, without escapes: what is compared and searched in it has none.
std::optional<std::string> instruction_of(const std::string& line) {
  const std::string key = "\"instruction\":";
  std::size_t from = line.find(key);
  if (from == std::string::npos) return std::nullopt;
  from = line.find('"', from + key.size());
  const std::size_t to = line.find('"', from + 1);
  if (from == std::string::npos || to == std::string::npos) return std::nullopt;
  return line.substr(from + 1, to - from - 1);
}

std::string without_progress(const std::string& words) {
  return words.substr(0, words.find(" ("));
}

constexpr const char* kPage = "page:";

/// What the participant's page of an experiment asks for: touches once, else goes along with the device.
sim::HandProgram motion_at_page(const std::string& words, unsigned tries) {
  sim::HandProgram hand{.kind = Kind::kFollow};
  if (tries > 0) return hand;
  if (says(words, "Press straight down")) {
    hand.kind = Kind::kPress;
    hand.force_n = 2.5;
    hand.force_rate_n_per_s = 8.0;
    hand.hold_s = 0.1;
  } else if (says(words, "Press and stroke")) {
    hand.kind = Kind::kStroke;
    hand.force_n = 1.5;
    hand.force_rate_n_per_s = 2.0;
    hand.speed_mm_per_s = 80.0;
    hand.stroke_length_mm = 20.0;
    hand.repetitions = 3;
  }
  return hand;
}

}  // namespace

sim::HandProgram motion_for(const std::string& words, unsigned tries) {
  const std::array<double, 4> numbers = numbers_in(words);
  sim::HandProgram hand{.approach_mm_per_s = 40.0, .travel_s = 0.7};
  const auto press = [&hand](double force_n, double over_s, double hold_s) {
    hand.kind = Kind::kPress;
    hand.force_n = force_n;
    hand.force_rate_n_per_s = force_n / over_s;
    hand.hold_s = hold_s;
  };
  if (words.rfind(kPage, 0) == 0) return motion_at_page(words, tries);
  if (words.empty() || words.rfind("let go:", 0) == 0 || says(words, "let go for some seconds")) return hand;
  if (says(words, "touch lightly")) {
    hand.kind = Kind::kScan;
    hand.repetitions = static_cast<int>(numbers[0]);
    hand.stroke_length_mm = numbers[1];
    hand.place_mm.x = -0.5 * numbers[1];
    hand.speed_mm_per_s = 40.0;
  } else if (says(words, "stroke back and forth")) {
    hand.kind = Kind::kStroke;
    hand.force_n = numbers[0];
    hand.force_rate_n_per_s = 6.0;
    hand.speed_mm_per_s = numbers[1];
    hand.stroke_length_mm = 30.0;  // the line the person was given
    hand.repetitions = 4;
  } else if (says(words, "wave")) {
    const bool brisk = tries % 2 == 1;
    hand.kind = Kind::kSway;
    hand.tilt_deg = says(words, "all sides") ? 45.0 : brisk ? 20.0 : 40.0;
    hand.speed_mm_per_s = brisk ? 220.0 : 170.0;
    hand.rate_hz = 1.2;
    hand.hold_s = 3.0;
    hand.place_mm.z = kClearOfObjectsMm;
  } else if (says(words, "strike")) {
    hand.kind = Kind::kSway;  // wide, and faster than the 200 mm/s that are missing
    hand.speed_mm_per_s = 320.0;
    hand.rate_hz = 1.2;
    hand.hold_s = 3.0;
    hand.place_mm.z = kClearOfObjectsMm;
  } else if (says(words, "hold the tool still")) {
    hand.place_mm.z = kClearOfObjectsMm;
    hand.hold_s = 2.0;
  } else if (says(words, "press the object to")) {
    press(numbers[0], 0.25, 0.9);
    hand.travel_s = 0.3;
    hand.approach_mm_per_s = 120.0;
  } else if (says(words, "press the rigid object to")) {
    press(numbers[0], 0.5, 0.05);
  } else if (says(words, "press the wall")) {
    press(numbers[3], 0.35, 0.05);
    hand.place_mm = {numbers[0], numbers[1], numbers[2]};
  } else if (says(words, "press harder")) {
    press(numbers[0] * (1.0 + 0.1 * std::min(tries, 4U)), 0.7, 0.5);
  } else if (says(words, "hold still for a second under")) {
    press(2.0 * numbers[0], 0.7, 1.5 + 0.3 * std::min(tries, 4U));
  } else if (says(words, "press deeper") || says(words, "press faster")) {
    press(3.0 + 0.4 * (tries % 3), 0.1, 0.1);
    if (says(words, "faster") && tries % 3 == 1) {
      hand.kind = Kind::kTap;
      hand.speed_mm_per_s = std::min(400.0, 4.0 * numbers[0]);
      hand.repetitions = 3;
    }
  } else {  // slowly, at a moderate speed, let go more slowly, a few times more
    constexpr std::array kOverS{1.5, 0.4, 0.8, 0.2};
    const double over_s = says(words, "slow") ? 1.8 : kOverS[tries % kOverS.size()];
    press(2.7 - 0.5 * (tries % 3), over_s, 0.2);
  }
  return hand;
}

bool InstructedHand::read() {
  std::ifstream lines(file_);
  lines.seekg(read_to_);
  std::string now = words_;
  for (std::string line; std::getline(lines, line) && !lines.eof();) {  // whole lines only
    read_to_ = lines.tellg();
    if (const auto words = instruction_of(line)) now = *words;
  }
  if (without_progress(now) == without_progress(words_)) return false;
  words_ = std::move(now);
  tries_ = 0;
  return true;
}

sim::HandProgram InstructedHand::next() {
  const sim::HandProgram hand = motion_for(words_, tries_++);
  follows_ = hand.kind == Kind::kFollow;
  return hand;
}

bool InstructedHand::acts_at_once() const {
  return follows_ || words_.rfind("let go:", 0) == 0;
}

}  // namespace hapticd::emulators
