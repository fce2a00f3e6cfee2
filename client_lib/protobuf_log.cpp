#include "client_lib/protobuf_log.hpp"

#include <google/protobuf/stubs/logging.h>

#include <string>

#include "ipc/framing.hpp"

namespace swarmtalk::client {
namespace {

google::protobuf::LogHandler* next_handler = nullptr;

void filter(google::protobuf::LogLevel level, const char* file, int line, const std::string& text) {
  if (ipc::is_inside_protobuf()) return;
  if (next_handler != nullptr) next_handler(level, file, line, text);
}

}  // namespace

void filter_protobuf_log() {
  static const bool is_set = [] {
    next_handler = google::protobuf::SetLogHandler(filter);
    return true;
  }();
  static_cast<void>(is_set);
}

}  // namespace swarmtalk::client
