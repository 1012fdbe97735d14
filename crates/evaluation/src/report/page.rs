//! The page: head, style sheets, and the sections that have something to show.

use super::markup::Element;
use super::{ReportData, bars, measures, paths, prose, tables, training};

/// Looks of figures, shared with figures that stand alone.
pub(super) const FIGURE_STYLE: &str = include_str!("figure.css");
const PAGE_STYLE: &str = include_str!("page.css");

/// The whole document.
pub(super) fn page(data: &ReportData) -> String {
    let html = Element::new("html").with("lang", "en").child(head(data)).child(body(data));
    format!("<!DOCTYPE html>\n{html}")
}

/// The title, or words in its place.
pub(super) fn title(data: &ReportData) -> &str {
    if data.title.trim().is_empty() { "Guidance report" } else { &data.title }
}

fn head(data: &ReportData) -> Element {
    let viewport =
        Element::new("meta").with("name", "viewport").with("content", "width=device-width, initial-scale=1");
    Element::new("head")
        .child(Element::new("meta").with("charset", "utf-8"))
        .child(viewport)
        .child(Element::new("title").text(title(data)))
        .child(Element::new("style").verbatim(FIGURE_STYLE).verbatim(PAGE_STYLE))
}

fn body(data: &ReportData) -> Element {
    let sections = [
        section("Behavior reward", [tables::rewards(data)]),
        data.training.as_ref().and_then(|curves| section("Training", training::figures(curves))),
        section("Success", [bars::success(data)]),
        section("Paths", [paths::from_above(data)]),
        section("Cases", [tables::cases(data)]),
        section("What was lacking", [measures::missed(data)]),
        section("Reactions and comfort", [measures::reactions(data)]),
        section("What was understood", [measures::confusion(data)]),
        section("What counts as success", [prose::criteria(data)]),
        section("How this was made", [prose::notes(data)]),
    ];
    let main = Element::new("main").child(prose::header(data)).children(sections.into_iter().flatten());
    Element::new("body").child(main)
}

/// A heading and what stands under it; nothing at all where nothing does.
fn section(heading: &str, parts: impl IntoIterator<Item = Option<Element>>) -> Option<Element> {
    let mut parts = parts.into_iter().flatten().peekable();
    parts.peek()?;
    Some(Element::new("section").child(Element::new("h2").text(heading)).children(parts))
}

/// A drawing with its caption.
pub(super) fn figure(drawing: Element, caption: Element) -> Element {
    Element::new("figure").child(drawing).child(caption)
}
