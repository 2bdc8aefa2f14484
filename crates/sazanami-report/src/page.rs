//! The frame of a page: head, styles, scripts, and what charts and warnings look like.

use serde_json::Value;

use crate::charts::Chart;
use crate::html::Html;
use crate::typeset::typeset;
use crate::view::View;

/// Content security policy: the page may load nothing from anywhere.
const POLICY: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src \
                      'unsafe-inline'; style-src 'unsafe-inline'; img-src data:\">\n";

/// A page with this title; `fill` adds what is in it, and returns its charts. A `view` brings its data and scripts.
pub fn page<E>(
    title: &str,
    view: Option<&View>,
    fill: impl FnOnce(&mut Html) -> Result<Vec<Chart>, E>,
) -> Result<String, E> {
    let mut html = Html::default();
    html.raw("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.raw(POLICY);
    html.raw("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    html.element("title", &[], title);
    html.raw("<style>\n");
    html.raw(include_str!("../assets/vendor/uPlot.min.css"));
    html.raw(include_str!("../assets/report.css"));
    html.raw("</style>\n</head>\n<body>\n<a class=\"skip\" href=\"#answer\">Skip to the answer</a>\n<main>\n");
    let charts = fill(&mut html)?;
    html.raw("</main>\n");
    html.data("charts-data", &charts.iter().map(Chart::json).collect::<Value>());
    html.raw("<script>\n");
    html.raw(include_str!("../assets/vendor/uPlot.iife.min.js"));
    html.raw("</script>\n<script>\n");
    html.raw(include_str!("../assets/charts.js"));
    html.raw("</script>\n");
    if let Some(view) = view {
        html.data("view-head", &view.head);
        html.bytes("view-bytes", &view.bytes);
        html.raw("<script>\n");
        html.raw(include_str!("../assets/vendor/three.min.js"));
        html.raw("</script>\n<script>\n");
        html.raw(include_str!("../assets/view.js"));
        html.raw("</script>\n");
    }
    html.raw("</body>\n</html>\n");
    Ok(html.into_text())
}

/// Links to the sections.
pub fn contents(html: &mut Html, sections: &[(&str, &str)]) {
    html.raw("<nav aria-label=\"Sections\"><ul>\n");
    for (id, heading) in sections {
        html.raw("<li>");
        html.element("a", &[("href", &format!("#{id}"))], heading);
        html.raw("</li>\n");
    }
    html.raw("</ul></nav>\n");
}

/// The places of charts, numbered from `first`; the script draws into them.
pub fn charts(html: &mut Html, first: usize, charts: &[Chart]) {
    html.raw("<div class=\"charts\">\n");
    for (number, chart) in charts.iter().enumerate() {
        let id = format!("chart-{}", first + number);
        let label =
            format!("Chart: {}. Left and right arrow keys read values, plus and minus zoom, 0 shows all.", chart.title);
        html.open("figure", &[("class", "chart"), ("id", &id)]);
        html.element("figcaption", &[], &chart.title);
        html.open("div", &[("class", "plot"), ("tabindex", "0"), ("role", "group"), ("aria-label", &label)]);
        html.raw("<noscript>This chart needs JavaScript; its values are in the table below.</noscript>");
        html.close("div");
        html.raw("<div class=\"keys\"></div>\n<p class=\"read\" aria-live=\"polite\"></p>\n");
        if chart.every > 1 {
            let note = format!(
                "Of every {} rows of the table those with the least and the greatest value of each curve are shown.",
                chart.every
            );
            html.element("p", &[("class", "note")], &note);
        }
        html.raw("<details><summary>Values as a table</summary>\n");
        let headings = ["quantity", "unit", "least", "greatest", "last"];
        html.table(&format!("{}: range of the values", chart.title), &headings, &chart.summary());
        html.raw("<div class=\"values\"></div></details>\n");
        html.close("figure");
    }
    html.raw("</div>\n");
}

/// A list of what deserves attention.
pub fn warnings(html: &mut Html, warnings: &[String]) {
    html.section("warnings", "Warnings");
    if warnings.is_empty() {
        html.raw("<p>None.</p>\n");
    } else {
        html.raw("<ul class=\"warnings\">\n");
        warnings.iter().for_each(|warning| html.element("li", &[], &typeset(warning)));
        html.raw("</ul>\n");
    }
    html.close("section");
}
