#include "tests/study/page.h"

#include "tests/study/report/html_page.h"

namespace hapticd::study {

void write_report_page(StudyContext& context) {
  report::write_page(context.report.folder(),
                     {.title = "hapticd: error, stability, cost", .introduction = "", .order = {}});
}

}  // namespace hapticd::study
