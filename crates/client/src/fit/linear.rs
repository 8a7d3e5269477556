//! Linear least squares with few unknowns.

/// What was fitted.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fit {
    /// Coefficients, in the order of the regressors.
    pub(crate) coefficients: Vec<f64>,
    /// Root of the mean square of what is left.
    pub(crate) rms: f64,
}

/// Coefficients c for which the sum of (y − Σ c·x)² is least, from rows of (x, y). `None` if the
/// rows do not determine them.
///
/// Solved by Householder reflections, which lose no digits to the squares of normal equations.
pub(crate) fn fit(rows: &[(Vec<f64>, f64)]) -> Option<Fit> {
    let unknowns = rows.first()?.0.len();
    if rows.len() < unknowns || unknowns == 0 {
        return None;
    }
    // Columns of like size, so that "nearly zero" has a meaning.
    let mut scale = vec![0.0f64; unknowns];
    for (x, _) in rows {
        for (s, value) in scale.iter_mut().zip(x) {
            *s = s.max(value.abs());
        }
    }
    if scale.iter().any(|s| *s <= 0.0 || !s.is_finite()) {
        return None;
    }
    let mut matrix: Vec<Vec<f64>> = rows
        .iter()
        .map(|(x, y)| {
            let mut row: Vec<f64> = x.iter().zip(&scale).map(|(v, s)| v / s).collect();
            row.push(*y);
            row
        })
        .collect();
    for column in 0..unknowns {
        let length = matrix[column..]
            .iter()
            .map(|row| row[column] * row[column])
            .sum::<f64>()
            .sqrt();
        if length < 1e-9 * (rows.len() as f64).sqrt() {
            return None;
        }
        let alpha = if matrix[column][column] > 0.0 {
            -length
        } else {
            length
        };
        let mut mirror: Vec<f64> = matrix[column..].iter().map(|row| row[column]).collect();
        mirror[0] -= alpha;
        let square: f64 = mirror.iter().map(|m| m * m).sum();
        if square <= 0.0 {
            continue;
        }
        for other in column..=unknowns {
            let along: f64 = mirror
                .iter()
                .zip(&matrix[column..])
                .map(|(m, row)| m * row[other])
                .sum();
            let twice = 2.0 * along / square;
            for (m, row) in mirror.iter().zip(matrix[column..].iter_mut()) {
                row[other] -= twice * m;
            }
        }
    }
    let mut coefficients = vec![0.0; unknowns];
    for place in (0..unknowns).rev() {
        let known: f64 = (place + 1..unknowns)
            .map(|other| matrix[place][other] * coefficients[other])
            .sum();
        coefficients[place] = (matrix[place][unknowns] - known) / matrix[place][place];
    }
    let left: f64 = matrix[unknowns..]
        .iter()
        .map(|row| row[unknowns] * row[unknowns])
        .sum();
    for (c, s) in coefficients.iter_mut().zip(&scale) {
        *c /= s;
    }
    coefficients.iter().all(|c| c.is_finite()).then(|| Fit {
        coefficients,
        rms: (left / rows.len() as f64).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::fit;

    #[test]
    fn a_line_is_found_and_what_it_leaves_is_told() {
        let rows: Vec<_> = (0..100)
            .map(|n| {
                let x = f64::from(n) * 1e-3;
                let noise = if n % 2 == 0 { 0.5 } else { -0.5 };
                (
                    vec![1.0, x, 1e6 * x * x],
                    3.0 - 20.0 * x + 7.0 * x * x + noise,
                )
            })
            .collect();
        let found = fit(&rows).unwrap();
        assert!((found.coefficients[0] - 3.0).abs() < 0.05);
        assert!((found.coefficients[1] + 20.0).abs() < 5.0);
        assert!((found.coefficients[2] - 7e-6).abs() < 5e-5);
        assert!((found.rms - 0.5).abs() < 0.01);
    }

    #[test]
    fn what_the_rows_do_not_determine_is_refused() {
        assert_eq!(fit(&[]), None);
        let same: Vec<_> = (0..9).map(|n| (vec![1.0, 2.0], f64::from(n))).collect();
        assert_eq!(fit(&same), None);
        let few = [(vec![1.0, 2.0], 1.0)];
        assert_eq!(fit(&few), None);
        assert_eq!(fit(&[(vec![f64::NAN], 1.0), (vec![1.0], 1.0)]), None);
    }
}
