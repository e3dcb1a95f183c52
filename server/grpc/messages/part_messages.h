#pragma once

#include <string>

#include "hal/part_report.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

/// Fills a driver's own report into the fields that PartReport and Turntable share. Its texts may hold any
/// bytes.
template <class Message>
void fill_report(const hal::PartReport& report, Message& message) {
  message.set_driver(report.driver);
  message.set_connection(printable(report.connection));
  for (const std::string& finding : report.findings) message.add_findings(printable(finding));
  for (const hal::PartFigure& figure : report.figures) {
    auto& reported = *message.add_figures();
    reported.set_name(figure.name);
    reported.set_value(figure.value);
    reported.set_unit(figure.unit);
  }
}

}  // namespace hapticd::server
