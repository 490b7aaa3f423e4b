pub(crate) struct Chart {
    pub(crate) title: String,
    pub(crate) description: String,
    pub(crate) y_label: String,
    pub(crate) logarithmic: bool,
    pub(crate) reference: Option<f64>,
    pub(crate) categories: Vec<String>,
    pub(crate) series: Vec<Series>,
}
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) printed: bool,
    pub(crate) points: Vec<Option<Point>>,
}
#[derive(Clone, Copy)]
pub(crate) struct Point {
    pub(crate) value: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}
impl Chart {
    pub(crate) fn svg(&self) -> Result<String, String> {
        Ok("<svg/>".into())
    }
}
