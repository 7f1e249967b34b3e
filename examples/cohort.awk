# SPDX-License-Identifier: Apache-2.0
# The tables and the plot of cohort.mk: rows with tabs between name, size, factor, seconds, MiB, PSNR of cubic, PSNR, SSIM
# and residual (what follows says of which files), or a name and "failed"; `as` is csv, md or svg.
BEGIN {
	FS = "\t"
	columns = split("scan size factor seconds memory-mib cubic-psnr-db psnr-db ssim residual-rms-hu", head, " ")
	put(head)
	if (as == "md")
		print "|---|---|---|---:|---:|---:|---:|---:|---:|"
}
# A row, whose first cell is text as it stands in the table.
function put(cell,   k, text) {
	if (as == "svg")
		return
	for (k = 1; k <= columns; k++)
		text = text (k == 1 ? "" : as == "md" ? " | " : ",") cell[k]
	print as == "md" ? "| " text " |" : text
}
function xml(text) {
	gsub(/&/, "\\&amp;", text)
	gsub(/</, "\\&lt;", text)
	gsub(/>/, "\\&gt;", text)
	return text
}
{
	for (k = 1; k <= columns; k++)
		row[k] = $k
	scan[NR] = $1
	for (k = 4; k <= columns; k++)
		if ($k ~ /^-?[0-9.]+([eE][-+]?[0-9]+)?$/) {
			count[k]++
			sum[k] += $k
			value[NR, k] = $k
		}
	if (as == "csv") {
		gsub(/"/, "\"\"", row[1])
		row[1] = "\"" row[1] "\""
	} else
		gsub(/[|]/, "\\|", row[1])
	put(row)
}
# Mean, or standard deviation, of each column of numbers.
function summary(name, deviation,   k, i, off) {
	split("", row)
	row[1] = name
	for (k = 4; k <= columns; k++) {
		if (!count[k])
			continue
		off = 0
		for (i = 1; i <= NR; i++)
			if ((i, k) in value)
				off += (value[i, k] - sum[k] / count[k]) ^ 2
		row[k] = deviation ? count[k] > 1 ? sprintf("%.4g", sqrt(off / (count[k] - 1))) : "" : sprintf("%.6g", sum[k] / count[k])
	}
	put(row)
}
# A line a scan, from the PSNR of cubic to that of the result; without truths, bars of seconds.
function plot(   truth, k, i, lo, hi, x, y, x0) {
	truth = count[7] > 0
	lo = truth ? 1e9 : 0
	hi = -1e9
	for (i = 1; i <= NR; i++)
		for (k = truth ? 6 : 4; k <= (truth ? 7 : 4); k++)
			if ((i, k) in value) {
				lo = value[i, k] < lo ? value[i, k] : lo
				hi = value[i, k] > hi ? value[i, k] : hi
			}
	lo = truth ? int(lo) - 1 : 0
	hi = hi > lo ? int(hi) + 1 : lo + 1
	printf "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"640\" height=\"%d\" viewBox=\"0 0 640 %d\">\n", 24 * NR + 60, 24 * NR + 60
	print "<style>svg{background:#fff}text{font:13px system-ui,\"DejaVu Sans\",Arial,sans-serif;fill:#222}line{stroke:#999}</style>"
	for (i = 1; i <= NR; i++) {
		y = 24 * i
		printf "<text x=\"8\" y=\"%d\">%s</text>\n", y + 4, xml(length(scan[i]) > 28 ? substr(scan[i], 1, 25) "..." : scan[i])
		for (k = truth ? 6 : 4; k <= (truth ? 7 : 4); k++)
			x[k] = (i, k) in value ? 230 + 380 * (value[i, k] - lo) / (hi - lo) : ""
		x0 = truth ? x[6] : 230
		if (x0 != "" && x[truth ? 7 : 4] != "")
			printf "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\"/>\n", x0, y, x[truth ? 7 : 4], y
		for (k = truth ? 6 : 4; k <= (truth ? 7 : 4); k++)
			if (x[k] != "")
				printf "<circle cx=\"%.1f\" cy=\"%d\" r=\"5\" fill=\"%s\"><title>%s</title></circle>\n", x[k], y, k == 6 ? "#d95f02" : "#1b6ca8", value[i, k]
		if (!((i, 4) in value))
			printf "<text x=\"230\" y=\"%d\">failed</text>\n", y + 4
	}
	printf "<line x1=\"230\" y1=\"%d\" x2=\"610\" y2=\"%d\"/>\n", 24 * NR + 20, 24 * NR + 20
	for (i = 0; i <= 4; i++)
		printf "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%.3g</text>\n", 230 + 95 * i, 24 * NR + 36, lo + i * (hi - lo) / 4
	printf "<text x=\"420\" y=\"%d\" text-anchor=\"middle\">%s</text>\n</svg>\n", 24 * NR + 54, truth ? "PSNR, dB: cubic (orange), ct-sr (blue)" : "seconds"
}
END {
	summary("mean", 0)
	summary("deviation", 1)
	if (as == "svg")
		plot()
}
