use std::fmt::Write;

use sazanami_numerics::geometry::{SpheroidMesh, VolumeRule, box_mesh, spheroid_mesh};

use super::*;

const HEAD_2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";

/// The unit corner tetrahedron with surface elements, a physical name and a node on nothing.
fn corner_2() -> String {
    format!(
        "{HEAD_2}$PhysicalNames\n1\n3 1 \"sand $EndNodes\"\n$EndPhysicalNames\n$Nodes\n5\n10 0 0 0\n20 1 0 0\n\
         30 0 1 0\n40 0 0 1\n50 7 7 7\n$EndNodes\n$Elements\n3\n1 15 2 0 1 10\n2 2 2 0 -1 10 30 20\n\
         7 4 2 1 1 10 20 30 40\n$EndElements\n"
    )
}

fn corner_41() -> String {
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 0 0\n$EndEntities\n$Nodes\n2 5 10 50\n\
     2 1 1 2\n10\n20\n0 0 0 0.1 0.2\n1 0 0 0.1 0.2\n3 1 0 3\n30\n40\n50\n0 1 0\n0 0 1\n7 7 7\n$EndNodes\n\
     $Elements\n2 2 1 7\n2 1 2 1\n1 10 30 20\n3 1 4 1\n7 10 20 30 40\n$EndElements\n"
        .to_owned()
}

/// The same as binary, in either byte order.
fn corner_binary(version: Version, swap: bool) -> Vec<u8> {
    let int = |v: i32| if swap { v.to_be_bytes() } else { v.to_le_bytes() };
    let size = |v: u64| if swap { v.to_be_bytes() } else { v.to_le_bytes() };
    let real = |v: Real| if swap { v.to_be_bytes() } else { v.to_le_bytes() };
    let points = [(10, [0.0, 0.0, 0.0]), (20, [1.0, 0.0, 0.0]), (30, [0.0, 1.0, 0.0]), (40, [0.0, 0.0, 1.0])];
    let name = if version == Version::Two { "2.2" } else { "4.1" };
    let mut bytes = format!("$MeshFormat\n{name} 1 8\n").into_bytes();
    bytes.extend(int(1));
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    match version {
        Version::Two => {
            bytes.extend(b"4\n");
            for (tag, p) in points {
                bytes.extend(int(tag));
                p.iter().for_each(|&v| bytes.extend(real(v)));
            }
            bytes.extend(b"\n$EndNodes\n$Elements\n2\n");
            [2, 1, 2, 1, -5, 1, 10, 30, 20, 4, 1, 2, 7, 1, 1, 10, 20, 30, 40]
                .into_iter()
                .for_each(|v| bytes.extend(int(v)));
        }
        Version::Four => {
            [1, 4, 10, 40].into_iter().for_each(|v| bytes.extend(size(v)));
            [3, 1, 0].into_iter().for_each(|v| bytes.extend(int(v)));
            bytes.extend(size(4));
            points.iter().for_each(|p| bytes.extend(size(p.0 as u64)));
            points.iter().flat_map(|p| p.1).for_each(|v| bytes.extend(real(v)));
            bytes.extend(b"\n$EndNodes\n$Elements\n");
            [1, 1, 7, 7].into_iter().for_each(|v| bytes.extend(size(v)));
            [3, 1, 4].into_iter().for_each(|v| bytes.extend(int(v)));
            [1, 7, 10, 20, 30, 40].into_iter().for_each(|v| bytes.extend(size(v)));
        }
    }
    bytes.extend(b"\n$EndElements\n");
    bytes
}

/// The mesh as an MSH 2.2 text file, lengths in metres.
fn to_msh(mesh: &TetrahedralMesh) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", mesh.nodes.len());
    for (index, p) in mesh.nodes.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {:e} {:e} {:e}", index + 1, p.x, p.y, p.z);
    }
    let _ = write!(text, "$EndNodes\n$Elements\n{}\n", mesh.tetrahedra.len());
    for (index, nodes) in mesh.tetrahedra.iter().enumerate() {
        let [a, b, c, d] = nodes.map(|n| n + 1);
        let _ = writeln!(text, "{} 4 2 1 1 {a} {b} {c} {d}", index + 1);
    }
    text.push_str("$EndElements\n");
    text
}

fn message(text: &str) -> String {
    parse(text.as_bytes(), 1.0).unwrap_err().to_string()
}

#[test]
fn every_flavour_gives_the_same_mesh() {
    let found = parse(corner_2().as_bytes(), 1e-3).unwrap();
    assert_eq!((found.ignored_elements, found.dropped_nodes), (2, 1));
    assert_eq!(found.mesh.nodes[1], Vector::new(1e-3, 0.0, 0.0));
    assert_eq!(found.mesh.tetrahedra, [[0, 1, 2, 3]]);
    let windows = corner_2().replace('\n', "\r\n");
    for bytes in [
        corner_41().into_bytes(),
        windows.into_bytes(),
        corner_binary(Version::Two, false),
        corner_binary(Version::Two, true),
        corner_binary(Version::Four, false),
        corner_binary(Version::Four, true),
    ] {
        assert_eq!(parse(&bytes, 1e-3).unwrap().mesh, found.mesh);
    }
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    for mesh in [
        box_mesh(Vector::new(0.1, 0.2, 0.3)),
        spheroid_mesh(0.26e-3, 0.635e-3, SpheroidMesh::PAPER, VolumeRule::Inscribed),
    ] {
        assert_eq!(parse(to_msh(&mesh).as_bytes(), 1.0).unwrap().mesh, mesh);
    }
}

#[test]
fn a_file_that_is_not_a_mesh_is_recognised() {
    for (text, hint) in [
        ("", "it is empty"),
        ("solid ball\nfacet normal", "an STL surface, which has to be filled with tetrahedra. To fill `grain.stl`"),
        ("# vtk DataFile Version 3.0", "VTK"),
        ("<?xml version=\"1.0\"?>", "XML"),
        ("*NODE\n1,0,0,0", "Abaqus"),
        ("$NOD\n4", "version 1"),
        ("hello there", "'hello there'"),
        ("\u{89}PNG\u{1a}", "'?PNG?'"),
    ] {
        let error = parse(text.as_bytes(), 1.0).unwrap_err();
        assert!(matches!(error, MeshFileError::NotMesh { .. }));
        assert!(error.to_string().contains(hint) || text.starts_with('\u{89}'), "{error}");
    }
    assert!(matches!(read(Path::new("/no/such.msh"), 1.0), Err(MeshFileError::Unreadable { .. })));
}

#[test]
fn faults_are_named_by_line() {
    let good = corner_2();
    let line_of = |needle: &str| good.lines().position(|l| l.contains(needle)).unwrap() + 1;
    for (from, to, line, word) in [
        ("2.2 0 8", "4.0 0 8", 2, "gmsh -save"),
        ("2.2 0 8", "2.2 0 4", 2, "4 bytes"),
        ("20 1 0 0", "20 1 zero 0", line_of("20 1 0 0"), "three finite coordinates"),
        ("20 1 0 0", "20 1 nan 0", line_of("20 1 0 0"), "three finite coordinates"),
        ("20 1 0 0", "20 1 0", line_of("20 1 0 0"), "three finite coordinates"),
        ("\n5\n", "\nfive\n", line_of("5"), "number of entries"),
        ("\n5\n", "\n6\n", line_of("50 7") + 1, "whole number"),
        ("7 4 2 1 1 10 20 30 40", "7 4 2 1 1 10 20 30", line_of("7 4 2"), "should hold 9 numbers, not 8"),
        ("7 4 2 1 1 10 20 30 40", "7 4 2 1 1 10 20 30 99", line_of("7 4 2"), "names node 99"),
        ("7 4 2 1 1 10 20 30 40", "7 4 2 1 1 20 10 30 40", line_of("7 4 2"), "element 7: tetrahedron 1 is inverted"),
        ("7 4 2 1 1 10 20 30 40", "7 88 2 1 1 10 20 30 40", line_of("7 4 2"), "no element type 88"),
        ("7 4 2 1 1 10 20 30 40", "7 5 2 1 1 1 1 1 1 1 1 1 1", line_of("7 4 2"), "solids of 8 nodes"),
        ("7 4 2 1 1 10 20 30 40", "7 11 2 1 1 1 1 1 1 1 1 1 1 1 1", line_of("7 4 2"), "-order 1"),
        ("50 7 7 7", "40 7 7 7", line_of("7 4 2"), "node 40 is defined twice"),
        ("40 0 0 1", "40 0.3 0.3 0", line_of("7 4 2"), "degenerate"),
    ] {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from}");
        let error = parse(text.as_bytes(), 1.0).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
        assert_eq!(error.line(), Some(line), "{from} -> {to}: {error}");
    }
    assert!(message(&good.replace("7 4 2 1 1 10 20 30 40", "7 15 2 1 1 10")).contains("no tetrahedra"));
    // What comes of `gmsh -3` on a surface alone leads on, not back to `gmsh -3`.
    assert!(message(&good.replace("7 4 2 1 1 10 20 30 40", "7 2 2 1 1 10 20 30")).contains("Volume(1) = {1}"));
    assert!(message(&format!("{HEAD_2}stray")).contains("a section should start here"));
}

#[test]
fn a_torn_file_is_recognised_wherever_it_ends() {
    for bytes in [
        corner_2().into_bytes(),
        corner_41().into_bytes(),
        corner_binary(Version::Two, false),
        corner_binary(Version::Four, false),
    ] {
        for length in 0..bytes.len() - 1 {
            assert!(parse(&bytes[..length], 1.0).is_err(), "{length} of {}", bytes.len());
        }
    }
}

#[test]
fn absurd_counts_do_not_take_memory() {
    let text = corner_2().replacen("\n5\n", "\n4000000000000\n", 1);
    assert!(parse(text.as_bytes(), 1.0).is_err());
    let text = corner_2().replacen("7 4 2 1 1", "7 4 18446744073709551615 1 1", 1);
    assert!(parse(text.as_bytes(), 1.0).is_err());
}
