#include "client/cli/identify/identify_coverage.h"

#include <gtest/gtest.h>

#include <limits>

#include "client/cli/figure/gnuplot.h"
#include "client/cli/identify/identify_figure.h"
#include "tests/unit/client/identify/identify_fake_service.h"

namespace hapticd::cli {
namespace {

using State = CoverageCell::State;
const Terminal kAscii{};
const Terminal kUnicode{.unicode = true};

v1::CoverageMap map_of(std::uint32_t columns, std::uint32_t rows, const std::vector<std::uint32_t>& counts,
                       const std::vector<bool>& required, std::uint32_t enough) {
  v1::CoverageMap map;
  map.mutable_x()->set_quantity("displacement");
  map.mutable_x()->set_unit("mm");
  map.mutable_x()->set_to(columns);
  map.mutable_x()->set_bins(columns);
  map.mutable_y()->set_quantity("speed");
  map.mutable_y()->set_unit("mm/s");
  map.mutable_y()->set_to(10.0 * rows);
  map.mutable_y()->set_bins(rows);
  for (const auto count : counts) map.add_counts(count);
  for (const bool one : required) map.add_required(one);
  double wanted = 0.0, met = 0.0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const bool is_required = i < required.size() && required[i];
    map.add_enough(!is_required || counts[i] >= enough);
    wanted += is_required ? 1.0 : 0.0;
    met += is_required && counts[i] >= enough ? 1.0 : 0.0;
  }
  if (wanted > 0.0) map.set_share(met / wanted);
  return map;
}

TEST(IdentifyCoverage, EachCellSaysWhetherItIsWantedAndHasEnough) {
  const auto map = map_of(3, 2, {100, 2, 0, 0, 7, 90}, {true, true, true, false, false, true}, 50);
  const auto grid = coverage_grid(map, 10, 10);
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->columns, 3U);
  EXPECT_EQ(grid->rows, 2U);
  EXPECT_EQ(grid->at(0, 0).state, State::kEnough);
  EXPECT_EQ(grid->at(1, 0).state, State::kFew);
  EXPECT_EQ(grid->at(2, 0).state, State::kMissing);
  EXPECT_EQ(grid->at(0, 1).state, State::kEmpty);
  EXPECT_EQ(grid->at(1, 1).state, State::kExtra);
  EXPECT_EQ(grid->at(2, 1).state, State::kEnough);
}

TEST(IdentifyCoverage, TheMapIsDrawnWithAxesShadesAndBracketsAroundWhatIsWanted) {
  const auto map = map_of(3, 2, {100, 2, 0, 0, 7, 90}, {true, true, true, false, false, true}, 50);
  const auto lines = draw_coverage(map, 48, 8, kAscii);
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_EQ(lines[0], "speed / (mm/s)                      covered 50 %");
  EXPECT_EQ(lines[1], "    10|    + [#]");
  EXPECT_EQ(lines[2], "     0|[#][.][ ]");
  EXPECT_EQ(lines[3], "      +---------");
  EXPECT_TRUE(lines[4].ends_with("displacement / mm")) << lines[4];
  EXPECT_TRUE(lines[4].starts_with("       0")) << lines[4];
}

TEST(IdentifyCoverage, NeighboursArePutTogetherAndHaveEnoughOnlyIfAllHave) {
  // Two columns into one: enough next to nothing that is wanted, enough next to few.
  const auto map = map_of(4, 1, {50, 3, 50, 1}, {true, false, true, true}, 50);
  const auto grid = coverage_grid(map, 2, 1);
  ASSERT_TRUE(grid);
  ASSERT_EQ(grid->columns, 2U);
  EXPECT_EQ(grid->at(0, 0).count, 53U);
  EXPECT_EQ(grid->at(0, 0).state, State::kEnough);
  EXPECT_EQ(grid->at(1, 0).state, State::kFew);
}

TEST(IdentifyCoverage, ManyBinsFitTheRoomThereIs) {
  const std::uint32_t bins = 97;
  const auto map = map_of(bins, bins, std::vector<std::uint32_t>(bins * bins, 4000000000U),
                          std::vector<bool>(bins * bins, true), 1);
  for (const int width : {24, 40, 79}) {
    for (const int height : {5, 9, 30}) {
      const auto lines = draw_coverage(map, width, height, kUnicode);
      ASSERT_FALSE(lines.empty());
      EXPECT_LE(lines.size(), static_cast<std::size_t>(height));
      for (const auto& line : lines) EXPECT_LE(display_width(line), static_cast<std::size_t>(width)) << line;
    }
  }
}

TEST(IdentifyCoverage, AMapOverOneQuantityHasOneRow) {
  auto map = map_of(4, 1, {5, 5, 0, 0}, {true, true, true, true}, 5);
  map.mutable_y()->set_bins(0);
  const auto lines = draw_coverage(map, 48, 8, kAscii);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_TRUE(lines[0].starts_with("samples by displacement ")) << lines[0];
  EXPECT_EQ(lines[1], "      |[#][#][ ][ ]");
  // If the name of the quantity would hide its edges, it is below them.
  const auto narrow = draw_coverage(map, 30, 8, kAscii);
  ASSERT_EQ(narrow.size(), 5U);
  EXPECT_TRUE(narrow[3].starts_with("       0  1  2  3  4")) << narrow[3];
  EXPECT_TRUE(narrow[4].ends_with("displacement / mm")) << narrow[4];
}

TEST(IdentifyCoverage, AMapWhosePartsDoNotFitTogetherIsNotDrawn) {
  EXPECT_FALSE(coverage_grid({}, 10, 10));
  EXPECT_FALSE(coverage_grid(map_of(2, 2, {1, 2, 3}, {true, true, true, true}, 1), 10, 10));
  EXPECT_FALSE(coverage_grid(map_of(2, 2, {1, 2, 3, 4}, {true}, 1), 10, 10));
  auto huge = map_of(2, 1, {1, 2}, {true, true}, 1);
  huge.mutable_x()->set_bins(4000000000U);
  huge.mutable_y()->set_bins(4000000000U);
  EXPECT_FALSE(coverage_grid(huge, 10, 10));
  EXPECT_TRUE(draw_coverage(map_of(2, 1, {1, 2}, {true, true}, 1), 10, 10, kAscii).empty());
  auto older = map_of(2, 1, {1, 2}, {true, true}, 1);
  older.clear_enough();
  EXPECT_FALSE(coverage_grid(older, 10, 10)) << "which cells have enough is not guessed";
}

TEST(IdentifyFigure, ShowsTheFitAndTheCoverage) {
  const Figure figure = identify_figure(test::contact_progress(0.6));
  ASSERT_EQ(figure.panels.size(), 2U);
  const std::string script = gnuplot_script(figure, "fit.svg");
  for (const char* word :
       {"'measured'", "'model'", "'enough'", "'missing'", "'force / N'", "'speed / (mm/s)'",
        "contact-7: contact of sponge, running after 12.0 s", "residual 4.1 %"}) {
    EXPECT_NE(script.find(word), std::string::npos) << word;
  }
}

TEST(IdentifyFigure, HasNoPanelsWithoutData) {
  EXPECT_TRUE(identify_figure({}).panels.empty());
  v1::IdentificationProgress progress;
  progress.add_fit()->set_x(std::numeric_limits<double>::quiet_NaN());
  *progress.add_coverage() = map_of(2, 2, {1}, {true}, 1);
  EXPECT_TRUE(identify_figure(progress).panels.empty());
}

}  // namespace
}  // namespace hapticd::cli
