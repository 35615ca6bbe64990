//! The functions of the C header that read settings, find classes and rows: compiled as C and as C++, and run.

#![allow(clippy::unwrap_used, reason = "a test's helpers may fail loudly")]

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = r#"
#include "resurvey_plugin.h"
#include <stdio.h>
#define CHECK(is_so) do { if (!(is_so)) { printf("line %d: %s\n", __LINE__, #is_so); return 1; } } while (0)

int main(void) {
  /* Settings as the host writes them: sorted, without spaces; a text that looks like one of them; the last is cut below. */
  static const char json[] = "{\"all\":true,\"least_px\":150,\"name\":\"a\\\"least_px\\\":7,} \\\\ \\u0001\\n\",\"none\":\"\","
                             "\"ratio\":-2.5e-3,\"sky\":false,\"zz\":12345";
  rsv_text settings = {json, sizeof json - 1 - 2};
  CHECK(rsv_setting_number(settings, "least_px") == 150);
  CHECK(rsv_setting_number(settings, "ratio") == -2.5e-3);
  CHECK(rsv_setting_number(settings, "zz") == 123);
  CHECK(rsv_setting_number(settings, "least") == 0 && !rsv_setting(settings, "least").data);
  CHECK(rsv_setting_is_true(settings, "all") && !rsv_setting_is_true(settings, "sky") && !rsv_setting_is_true(settings, "no"));
  char text[64], small[4];
  CHECK(rsv_setting_text(settings, "name", text, sizeof text) == 20 && !strcmp(text, "a\"least_px\":7,} \\ \001\n"));
  CHECK(rsv_setting_text(settings, "name", small, sizeof small) == 20 && !strcmp(small, "a\"l"));
  CHECK(rsv_setting_text(settings, "none", text, sizeof text) == 0 && !text[0]);
  CHECK(rsv_setting_text(settings, "not there", text, sizeof text) == 0 && !text[0]);
  rsv_text empty = {NULL, 0};
  CHECK(!rsv_setting(empty, "a").data && rsv_setting_number(empty, "a") == 0);

  rsv_class classes[2];
  memset(classes, 0, sizeof classes);
  classes[0].name.data = "banners", classes[0].name.length = 7;
  classes[1].name.data = "banner", classes[1].name.length = 6;
  rsv_services services;
  memset(&services, 0, sizeof services);
  services.classes = classes, services.class_count = 2;
  CHECK(rsv_class_named(&services, "banner") == &classes[1] && !rsv_class_named(&services, "ban"));

  const uint8_t pixels[7] = {1, 2, 99, 99, 3, 4, 99};
  rsv_image image = {pixels, 2, 2, 4};
  CHECK(*(const uint8_t *)rsv_row(&image, 1) == 3);
  return 0;
}
"#;

fn passes(compiler: &str, standard: &str, file: &str) {
    if Command::new(compiler).arg("--version").output().is_err() {
        // Past the capture of the test harness: a skipped test should be seen.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no compiler {compiler}; the header was not tried with it");
        return;
    }
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (source, program) = (directory.join(file), directory.join(format!("{file}.program")));
    std::fs::write(&source, PROGRAM).unwrap();
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/include");
    let flags = [standard, "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", include, "-o"];
    let built = Command::new(compiler).args(flags).arg(&program).arg(&source).output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let run = Command::new(&program).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stdout));
}

#[test]
fn the_helpers_of_the_header_work_in_c() {
    passes("cc", "-std=c11", "header.c");
}

#[test]
fn the_helpers_of_the_header_work_in_cpp() {
    passes("c++", "-std=c++17", "header.cpp");
}
