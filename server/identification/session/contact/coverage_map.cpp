#include "server/identification/session/contact/coverage_map.h"

#include <algorithm>
#include <array>

#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr int kDepths = 5;
constexpr int kSpeeds = 5;  // out fast, out, slow, in, in fast

}  // namespace

Coverage contact_coverage(std::span<const PalpationSample> palpation, std::size_t stride,
                          const ContactDomain& domain) {
  Coverage map({"displacement", "mm", 0.0, domain.displacement_mm, kDepths},
               {"speed", "mm/s", -1.25 * domain.speed_mm_per_s, 1.25 * domain.speed_mm_per_s, kSpeeds});
  for (const PalpationSample& s : palpation) {
    if (!s.in_contact || !(s.displacement_mm > 0.0)) continue;
    map.counts[map.cell_at(s.displacement_mm, s.rate_mm_per_s)] += static_cast<std::uint32_t>(stride);
  }
  for (int depth = 1; depth < kDepths; ++depth) {
    if (!domain.speeds_required) {
      // Any speed will do: the most frequent one is taken.
      int most = 2;
      for (int speed = 0; speed < kSpeeds; ++speed) {
        if (map.counts[map.cell(depth, speed)] > map.counts[map.cell(depth, most)]) most = speed;
      }
      map.required[map.cell(depth, most)] = 1;
      continue;
    }
    map.required[map.cell(depth, 2)] = 1;
    if (depth < 4) {
      map.required[map.cell(depth, 3)] = 1;
      // However fast it is let go.
      map.required[map.cell(depth, map.counts[map.cell(depth, 0)] > map.counts[map.cell(depth, 1)] ? 0 : 1)] =
          1;
    }
    if (depth < 3) map.required[map.cell(depth, 4)] = 1;
  }
  map.enough_samples = static_cast<std::uint32_t>(domain.enough_samples);
  map.update_share();
  return map;
}

std::vector<MissingCoverage> missing_coverage(const Coverage& map, const ContactDomain& domain) {
  std::vector<MissingCoverage> missing;
  const double depth_mm = domain.displacement_mm / kDepths;
  // The deepest and fastest cells are hardest to reach, so they are asked for first.
  struct Row {
    int speed;
    CoverageNeed need;
    const char* words;
    double from;
  };
  static constexpr std::array kRows{
      Row{4, CoverageNeed::kFast, "press faster: %.3g mm/s and more between %.3g and %.3g mm", 0.75},
      Row{3, CoverageNeed::kModerate, "press at a moderate speed: about %.2g mm/s between %.3g and %.3g mm",
          0.5},
      Row{1, CoverageNeed::kModerate, "let go more slowly: at %.2g mm/s and more between %.3g and %.3g mm",
          0.25},
      Row{0, CoverageNeed::kModerate, "let go more slowly: at %.2g mm/s and more between %.3g and %.3g mm",
          0.25},
      Row{2, CoverageNeed::kSlow, "press slowly: below %.2g mm/s between %.3g and %.3g mm", 0.25}};
  for (const Row& row : kRows) {
    int first = kDepths, last = -1;
    for (int depth = 0; depth < kDepths; ++depth) {
      const std::size_t cell = map.cell(depth, row.speed);
      if (map.has_enough(cell)) continue;
      first = std::min(first, depth);
      last = std::max(last, depth);
    }
    if (last < 0) continue;
    missing.push_back({row.need, formatted(row.words, row.from * domain.speed_mm_per_s, depth_mm * first,
                                           depth_mm * (last + 1))});
  }
  return missing;
}

}  // namespace hapticd::identification
