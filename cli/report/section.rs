//! Parts that pages are put together from.

use super::base64::png_address;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style of every page.
const STYLE: &str = include_str!("style.css");

/// What is in the head of every page and of none of others.
pub const GENERATED: &str = "<meta name=\"generator\" content=\"resurvey\">";

/// A whole document.
pub fn document(title: &str, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content="resurvey";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (body) } }
        }
    }
}

/// A headed part of a page.
pub fn section(heading: &str, contents: &Markup) -> Markup {
    html! { section { h2 { (heading) } (contents) } }
}

/// An image with its caption, and what is drawn over it.
pub fn figure(png: &[u8], alt: &str, over: &Markup, caption: &Markup) -> Markup {
    html! {
        figure {
            div class="image" { img src=(png_address(png)) alt=(alt); (over) }
            figcaption { (caption) }
        }
    }
}

/// A table that scrolls by itself where the screen is too narrow.
pub fn table(heads: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div class="scroll" {
            table {
                thead { tr { @for head in heads { th scope="col" { (head) } } } }
                tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// A table of few rows with words in the last column; on a narrow screen each row becomes a block of its own.
pub fn rows(heads: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! { div class="rows" { (table(heads, rows)) } }
}

/// Pairs of a name and a value.
pub fn pairs(rows: &[(&str, Markup)]) -> Markup {
    html! { dl { @for (name, value) in rows { div { dt { (name) } dd { (value) } } } } }
}

/// The badge of a decision.
pub fn badge(decision: &str) -> Markup {
    let words = match decision {
        "nothing" => "nothing to update",
        "unreliable" => "pose not reliable",
        "dry-run" => "dry run",
        other => other,
    };
    html! { span class={ "badge " (decision) } { (words) } }
}
